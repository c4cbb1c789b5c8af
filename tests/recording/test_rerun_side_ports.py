"""An EP's further ports in lockstep: what goes out needs no repeat, what a pilot or a serial line sends is repeated."""

from __future__ import annotations

import asyncio
import contextlib
import os
import tty
from pathlib import Path

import pytest

from roboglot.model.components.interaction.input_device import InputDevice
from roboglot.model.geometry import Vector3
from roboglot.model.tap import Direction
from roboglot.protocols.robomaster.ports.serial_line import SERIAL
from roboglot.testing.addresses import free_addresses, free_port
from tests.recording.everything import ADDRESS, Session, begun
from tests.recording.test_rerun_clients import identical, until_gone

CLIENT = free_addresses(1)  # an address of its own, to which pushes go


class Signals(asyncio.DatagramProtocol):
    """Hears pushes."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []

    def datagram_received(self, data: bytes, _addr: object) -> None:
        self.heard.append(data)


async def swallow(port: int) -> tuple[asyncio.Task[int], asyncio.StreamWriter]:
    """Read a port that streams until it is hung up; the task returns the number of bytes."""
    reader, writer = await asyncio.open_connection(ADDRESS, port, local_addr=(CLIENT, 0))

    async def count() -> int:
        size = 0
        with contextlib.suppress(OSError):
            while data := await reader.read(1 << 16):
                size += len(data)
        return size

    return asyncio.ensure_future(count()), writer


async def say(session: Session, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *lines: str) -> None:
    for line in lines:
        writer.write(line.encode() + b";")
        assert (await reader.readuntil(b";")).strip() == b"ok;", line
        await session.clock.advance(0.113)


@pytest.mark.slow  # below, a pilot is repeated
async def test_outgoing_data_needs_no_repeat(tmp_path: Path) -> None:
    """Video, sound, events and pushes: whether one takes them changes nothing of what a robot does."""
    loop = asyncio.get_running_loop()
    async with begun(tmp_path, robomaster={"push_port": (port := free_port())}) as session:
        hearing, signals = await loop.create_datagram_endpoint(Signals, local_addr=(CLIENT, port))
        await session.clock.advance(1.037)
        reader, writer = await asyncio.open_connection(ADDRESS, 40923, local_addr=(CLIENT, 0))
        streams = [await swallow(number) for number in (40921, 40922, 40925)]
        await say(session, reader, writer, "command", "stream on", "audio on", "armor sensitivity 5")
        await say(session, reader, writer, "chassis push position on pfreq 5", "chassis speed x 0.3")
        await session.clock.advance(2.0)
        session.runtime.fleet.world.stage.push("a", Vector3(0.0, 4.0, 0.0))
        await session.clock.advance(1.0)
        writer.close()
        await until_gone(session, "robomaster")
        for _, stream in streams:
            stream.close()
        sizes = await asyncio.gather(*(task for task, _ in streams))
        hearing.close()
        await session.clock.advance(1.0)
    assert signals.heard
    assert sizes[0] > 1000
    pushed = {e.operation for e in (await identical(tmp_path)).of(door="robomaster") if e.direction is Direction.PUSH}
    assert "> chassis push" in pushed


async def test_a_pilot_drives_again(tmp_path: Path) -> None:
    port = free_port()
    async with begun(tmp_path, robomaster={"pilot_port": port}) as session:
        await session.clock.advance(1.037)
        reader, writer = await asyncio.open_connection(ADDRESS, 40923)
        await say(session, reader, writer, "command", "game_msg on")
        hands, pilot = await asyncio.open_connection(ADDRESS, port)
        for line in ("press w", "click left", "nonsense", "mouse 0.5 -0.2", "release w"):
            pilot.write(line.encode() + b"\n")
            assert await hands.readline()
            await session.clock.advance(0.317)
        pilot.write(b"press a\n")
        await hands.readline()
        pilot.close()
        device = session.runtime.fleet.robots["a"][InputDevice]
        async with asyncio.timeout(120):
            while device.state.keys:  # noqa: ASYNC110
                await asyncio.sleep(0.0005)
        await session.clock.advance(1.0)
        writer.close()
        await until_gone(session, "robomaster")
    pushed = [e.payload for e in (await identical(tmp_path)).of(door="robomaster") if e.direction is Direction.PUSH]
    assert len(set(pushed)) >= 4


@pytest.mark.slow  # the test above repeats a pilot on a side port
async def test_a_serial_line_of_its_own_is_played(tmp_path: Path) -> None:
    """The recorded path belongs to a robot that may live: a rerun leaves it alone."""
    link = tmp_path / "ep-a"
    async with begun(tmp_path, robomaster={"uart": str(tmp_path / "ep")}) as session:
        await session.clock.advance(1.037)
        line = os.open(link, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(line)
        texts = (b"command;", b"chassis push position on pfreq 5;", b"chassis speed x 0.3;")
        for number, text in enumerate(texts, 1):
            os.write(line, text)
            await session.until_heard("robomaster", Direction.REPLY, number)
            await session.clock.advance(0.5)
        assert session.runtime.fleet.robots["a"].actions.running()
        os.close(line)
    link.symlink_to("/dev/null")
    recording = await identical(tmp_path)
    assert link.readlink() == Path("/dev/null")
    assert recording.of(door="robomaster")[0].connection.startswith(SERIAL)
