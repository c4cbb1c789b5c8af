"""Relays of TCP and UDP that do to a link what networks do: delay, loss, silence, garbage, cuts, refusal."""

from __future__ import annotations

import asyncio
import contextlib

from roboglot.model.clock import Clock

RESENT = 0.25  # robot s after which TCP resends a lost piece
LOST = 8  # one piece in this many


class Fault:
    """Fault of all relays that share it; the attributes act at once."""

    def __init__(self) -> None:
        self.delay = 0.0  # robot s, each way
        self.lossy = False  # delays TCP, drops datagrams
        self.silent = False  # half-open: nothing passes, neither end is notified
        self.garbage = b""  # sent in place of the robot's next answers
        self.after = b""  # the question from which on garbage is the answer
        self.late = b"", 0.0  # a question whose own answer is late, by robot s
        self.refusing = False
        self.deaf = False  # drops datagrams: a firewall before the push port

    def heal(self) -> None:
        """End all faults."""
        vars(self).update(vars(Fault()))


class Proxy:
    """Proxy between TCP clients and ``target``; listens on ``port``. ``back``: the robot dials."""

    def __init__(self, clock: Clock, target: tuple[str, int], fault: Fault, *, back: bool = False) -> None:
        self._clock, self._target, self.fault, self._back = clock, target, fault, back
        self.port = 0
        self._server: asyncio.Server | None = None
        self._writers: set[asyncio.StreamWriter] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._closed = False

    async def start(self) -> None:
        """Listen."""
        self._server = await asyncio.start_server(self._accept, "127.0.0.1", 0)
        self.port = int(self._server.sockets[0].getsockname()[1])

    def cut(self) -> None:
        """Break every connection."""
        for writer in tuple(self._writers):
            writer.transport.abort()

    async def close(self) -> None:
        """Stop."""
        self._closed = True
        if self._server:
            self._server.close()
        self.cut()
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await asyncio.sleep(0.02)  # a client that was accepted or dialled meanwhile is closed, too
        for writer in tuple(self._writers):
            writer.transport.abort()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self.fault.refusing or self._closed:
            writer.transport.abort()
            return
        self._writers.add(writer)
        try:
            far_reader, far_writer = await asyncio.open_connection(*self._target)
        except OSError:
            writer.transport.abort()
            return
        self._writers.add(far_writer)
        if writer.transport.is_closing():  # cut meanwhile
            far_writer.transport.abort()
        asked: set[bytes] = set()
        for one, other, from_robot in ((reader, far_writer, self._back), (far_reader, writer, not self._back)):
            task = asyncio.ensure_future(self._relay(one, other, asked, from_robot=from_robot))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _relay(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, asked: set[bytes], *, from_robot: bool
    ) -> None:
        count = 0
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(65536):
                fault, count = self.fault, count + 1
                if fault.silent:
                    continue
                if fault.after and not from_robot and fault.after in data:
                    fault.garbage = b"\x00 no answer \r\n\r\n"
                question, late = fault.late
                if question and not from_robot and question in data:
                    asked.add(question)
                if from_robot and question in asked:
                    asked.clear()
                    await self._clock.sleep(late)
                wait = fault.delay + (RESENT if fault.lossy and count % LOST == 0 else 0.0)
                if wait:
                    await self._clock.sleep(wait)
                writer.write(fault.garbage if from_robot and fault.garbage else data)
        writer.transport.abort()
        self._writers.discard(writer)


class UdpProxy(asyncio.DatagramProtocol):
    """Passes what the robot pushes to ``port`` on to ``target``."""

    def __init__(self, clock: Clock, target: tuple[str, int], fault: Fault) -> None:
        self._clock, self._target, self.fault = clock, target, fault
        self._count = 0
        self._transport: asyncio.DatagramTransport | None = None
        self.port = 0

    async def start(self) -> None:
        """Listen."""
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=("127.0.0.1", 0))
        self.port = self._transport.get_extra_info("sockname")[1]

    def datagram_received(self, data: bytes, _addr: tuple[str, int]) -> None:
        self._count += 1
        fault = self.fault
        if (
            fault.silent
            or fault.refusing
            or fault.deaf
            or (fault.lossy and self._count % LOST == 0)
            or self._transport is None
        ):
            return
        if fault.delay:
            self._clock.call_later(fault.delay, lambda: self._pass_on(data))
        else:
            self._pass_on(fault.garbage or data)

    def _pass_on(self, data: bytes) -> None:
        if self._transport and not self._transport.is_closing():
            self._transport.sendto(data, self._target)

    async def close(self) -> None:
        """Stop."""
        if self._transport:
            self._transport.close()
