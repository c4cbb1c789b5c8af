"""Two protocols joined within the process behave as two ends of a TCP connection."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.transport.pipe import PIECE, PipeEnd, join

OWN, PEER = ("127.64.0.1", 7), ("127.0.0.1", 40923)


class Side(asyncio.Protocol):
    """Notes what happens to it; answers with ``answer``."""

    def __init__(self, answer: bytes = b"", *, half_open: bool = False) -> None:
        self.events: list[str] = []
        self.received = bytearray()
        self.sizes: list[int] = []
        self.transport: PipeEnd
        self._answer, self._half_open = answer, half_open

    def connection_made(self, transport: Any) -> None:
        self.transport = transport
        self.events.append("made")

    def data_received(self, data: bytes) -> None:
        self.received += data
        self.sizes.append(len(data))
        if self._answer:
            self.transport.write(self._answer)

    def eof_received(self) -> bool:
        self.events.append("end")
        return self._half_open

    def pause_writing(self) -> None:
        self.events.append("pause")

    def resume_writing(self) -> None:
        self.events.append("resume")

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - as asyncio names it
        self.events.append("lost")


def joined(caller: Side, callee: Side) -> None:
    join(caller, callee, OWN, PEER)


async def turns() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def test_written_bytes_are_received_at_once() -> None:
    caller, callee = Side(), Side(b"ok;")
    joined(caller, callee)
    caller.transport.write(b"command;")
    assert (callee.received, caller.received) == (b"command;", b"ok;")
    assert callee.transport.get_extra_info("peername") == caller.transport.get_extra_info("sockname") == OWN
    assert callee.transport.get_extra_info("socket") is None


async def test_a_close_comes_after_what_was_written() -> None:
    caller, callee = Side(), Side()
    joined(caller, callee)
    callee.transport.pause_reading()
    caller.transport.write(b"the last words")
    caller.transport.close()
    await turns()
    assert callee.events == ["made"]
    assert callee.transport.get_extra_info("hung_up")  # noticed even while nothing is read
    callee.transport.resume_reading()
    await turns()
    assert callee.received == b"the last words"
    assert callee.events == ["made", "end", "lost"]
    assert caller.events == ["made", "lost"]


async def test_a_half_closed_end_is_answered() -> None:
    caller, callee = Side(), Side(half_open=True)
    joined(caller, callee)
    caller.transport.write_eof()
    await turns()
    callee.transport.write(b"answer")
    callee.transport.close()
    await turns()
    assert caller.received == b"answer"
    assert (callee.events, caller.events) == (["made", "end", "lost"], ["made", "end", "lost"])


async def test_an_abort_ends_both_and_drops_what_waits() -> None:
    caller, callee = Side(), Side()
    joined(caller, callee)
    callee.transport.pause_reading()
    caller.transport.write(b"never read")
    callee.transport.abort()
    caller.transport.write(b"lost")
    await turns()
    assert caller.events == callee.events == ["made", "lost"]
    assert not callee.received


async def test_writer_that_is_ahead_is_asked_to_pause() -> None:
    caller, callee = Side(), Side()
    joined(caller, callee)
    callee.transport.pause_reading()
    caller.transport.write(bytes(3 * PIECE))
    assert caller.events == ["made", "pause"]
    assert caller.transport.get_write_buffer_size() == 3 * PIECE
    callee.transport.resume_reading()
    await turns()
    assert caller.events == ["made", "pause", "resume"]
    assert max(callee.sizes) <= PIECE  # a tunnel's window is counted in such pieces


async def test_an_error_ends_its_own_connection_only(caplog: pytest.LogCaptureFixture) -> None:
    class Broken(Side):
        def data_received(self, data: bytes) -> None:
            raise RuntimeError(data.decode())

    caller, callee = Side(), Broken()
    joined(caller, callee)
    caller.transport.write(b"boom")
    await turns()
    assert caller.events == callee.events == ["made", "lost"]
    assert "boom" in caplog.text


STEPS = st.lists(st.one_of(st.binary(min_size=1, max_size=40), st.sampled_from(["rest", "go on", "turn"])), max_size=30)


@given(STEPS)
def test_everything_arrives_in_order_however_the_reader_rests(steps: list[bytes | str]) -> None:
    async def check() -> None:
        caller, callee = Side(), Side()
        joined(caller, callee)
        for step in steps:
            match step:
                case "rest":
                    callee.transport.pause_reading()
                case "go on":
                    callee.transport.resume_reading()
                case "turn":
                    await turns()
                case bytes():
                    caller.transport.write(step)
        caller.transport.close()
        callee.transport.resume_reading()
        await turns()
        assert callee.received == b"".join(step for step in steps if isinstance(step, bytes))
        assert callee.events[-1] == caller.events[-1] == "lost"

    asyncio.run(check())
