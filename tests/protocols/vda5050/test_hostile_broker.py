"""Brokers that break MQTT, in bytes of this file's own: the door hangs up, dials again, and keeps little."""

from __future__ import annotations

import asyncio
import contextlib
import struct
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator

import pytest

pytest.importorskip("aiomqtt", reason="needs roboglot[vda5050]")

from roboglot.model.robot import Robot
from roboglot.protocols.vda5050 import intake, server
from roboglot.protocols.vda5050.config import Vda5050Config
from roboglot.protocols.vda5050.server import Vda5050Door
from roboglot.wire.vda5050.orders import MESSAGE_MAX

PATIENCE = 60.0  # real s
CONNECT, PUBLISH, SUBSCRIBE = 1, 3, 8  # types of packets
ORDER = b"uagv/v3/roboglot/S1/order"

pytestmark = pytest.mark.world("empty")


def packet(head: int, body: bytes) -> bytes:
    length, left = b"", len(body)
    while True:
        left, part = divmod(left, 128)
        length += bytes([part | (128 if left else 0)])
        if not left:
            return bytes([head]) + length + body


def published(topic: bytes, payload: bytes, head: int = 0x30, number: bytes = b"") -> bytes:
    return packet(head, struct.pack(">H", len(topic)) + topic + number + payload)


class Line:
    """The broker's end of one connection."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self.writer = reader, writer

    async def _packet(self) -> tuple[int, bytes]:
        head, length, shift = (await self._reader.readexactly(1))[0], 0, 0
        while True:
            part = (await self._reader.readexactly(1))[0]
            length, shift = length | (part & 127) << shift, shift + 7
            if part < 128:
                return head, await self._reader.readexactly(length)

    async def answer_until(self, word: bytes) -> bytes:
        """Answer the robot's packets as a broker until it publishes something that contains ``word``."""
        async with asyncio.timeout(PATIENCE):
            while True:
                head, body = await self._packet()
                if head >> 4 == CONNECT:
                    self.writer.write(packet(0x20, b"\0\0"))
                elif head >> 4 == SUBSCRIBE:
                    self.writer.write(packet(0x90, body[:2] + b"\x01"))
                elif head >> 4 == PUBLISH:
                    end = 2 + struct.unpack(">H", body[:2])[0]
                    if head & 6:
                        self.writer.write(packet(0x40, body[end : end + 2]))
                    if word in body:
                        return body

    async def ends(self) -> None:
        """Return when the robot hangs up."""
        with contextlib.suppress(ConnectionResetError):
            async with asyncio.timeout(PATIENCE):
                while await self._reader.read(65536):
                    pass


Refusals = asyncio.Queue[str]
Dialled = Callable[[], Awaitable[Line]]


@pytest.fixture
def refusals(robot: Robot) -> Iterator[Refusals]:
    """The reasons why messages were refused."""
    reasons: Refusals = asyncio.Queue()
    leave = robot.tap.listen(lambda exchange: reasons.put_nowait(exchange.refusal) if exchange.refusal else None)
    yield reasons
    leave()


@pytest.fixture
async def dialled(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Dialled]:
    """Return the next connection of a robot, which dials again at once."""
    monkeypatch.setattr(server, "RETRY", 0.0)
    lines: asyncio.Queue[Line] = asyncio.Queue()
    opened: list[asyncio.StreamWriter] = []

    def take(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        opened.append(writer)
        lines.put_nowait(Line(reader, writer))

    broker = await asyncio.start_server(take, "127.0.0.1", 0)
    port = broker.sockets[0].getsockname()[1]
    door = Vda5050Door(robot, Vda5050Config(broker=f"127.0.0.1:{port}", serials={robot.id: "S1"}))
    await door.start()

    async def next_one() -> Line:
        async with asyncio.timeout(PATIENCE):
            line = await lines.get()
        await line.answer_until(b"factsheet")
        return line

    yield next_one
    broker.close()
    for writer in opened:  # a broker that is there but does not answer would delay the door's end
        writer.close()
    await door.close()


@pytest.mark.parametrize(
    "sent",
    [
        published(b"\xff\xfe", b"{}"),  # a topic that is no UTF-8
        published(b"uagv/#", b"{}"),  # one that only subscriptions have
        published(ORDER, b"{}", 0x34, b"\0\1"),  # never asked for: QoS 2
        published(ORDER, b"{}", 0x36, b"\0\1"),  # no QoS at all
        packet(0x30, b"\xff\xffabc"),
        packet(0x40, b"\1"),
        b"\x30\xff\xff\xff\xff\xff\x01",
        b"\xf0\x00",
    ],
)
async def test_no_mqtt_ends_the_connection(sent: bytes, dialled: Dialled, refusals: Refusals) -> None:
    line = await dialled()
    line.writer.write(sent)
    await line.ends()
    again = await dialled()
    again.writer.write(published(ORDER, b"{}"))
    assert await refusals.get() == "headerId is missing"


async def test_missing_certificates_are_named_at_the_start(robot: Robot) -> None:
    door = Vda5050Door(robot, Vda5050Config(broker="127.0.0.1", tls=True, ca="/nowhere/ca.pem"))
    with pytest.raises(OSError, match=r"/nowhere/ca\.pem: No such file"):
        await door.start()
    await door.close()


async def test_only_the_beginning_of_long_messages_is_kept(
    dialled: Dialled, refusals: Refusals, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[int] = []
    put = intake.Intake._put

    def keep(self: intake.Intake, item: object) -> None:
        kept.append(len(item.payload))  # type: ignore[attr-defined]
        put(self, item)  # type: ignore[arg-type]

    monkeypatch.setattr(intake.Intake, "_put", keep)
    line = await dialled()
    line.writer.write(published(ORDER, b" " * (20 * MESSAGE_MAX), 0x32, b"\0\1"))
    assert await refusals.get() == f"the message has more than {MESSAGE_MAX} bytes"
    assert MESSAGE_MAX < kept[0] <= intake.PACKET_MAX
    line.writer.write(published(ORDER, b"[]"))
    assert await refusals.get() == "the message must be an object, not a list"
