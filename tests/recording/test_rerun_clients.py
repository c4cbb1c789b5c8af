"""Clients that come, hang up and call off in lockstep: a rerun does the same, or says what it cannot do."""

from __future__ import annotations

import asyncio
import dataclasses
import json
import struct
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

from roboglot.cli.recordings.rerun import NoRerun, configuration, reasons
from roboglot.console import program_runs
from roboglot.console.people.classes import Classes
from roboglot.console.studio.classroom import Classroom
from roboglot.model.inputs.external import CALLED_OFF, CAME, GONE
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.inputs import Inputs
from roboglot.recording.reader import Recording, read_recording
from tests.recording.everything import ADDRESS, Session, begun
from tests.recording.test_rerun import rerun


async def identical(folder: Path) -> Recording:
    """Run the recording again, and return it."""
    done = await asyncio.to_thread(rerun, folder / "r.mcap")
    assert done.stdout.startswith("identical: "), done.stdout + done.stderr
    assert done.returncode == 0
    return read_recording(folder / "r.mcap")


async def until_gone(session: Session, door: str, count: int = 1) -> None:
    async with asyncio.timeout(120):  # a busy machine
        while session.gone.count(door) < count:  # noqa: ASYNC110 - robots call back in the loop
            await asyncio.sleep(0.0005)


def ways(recording: Recording) -> list[str]:
    """Return what clients did beside asking."""
    return [f"{given.name} {given.kind}" for _, given in recording.inputs if given.kind in (CAME, GONE, CALLED_OFF)]


@pytest.mark.slow
async def test_a_text_client_hangs_up_while_it_drives(tmp_path: Path) -> None:
    async with begun(tmp_path) as session:
        reader, writer = await asyncio.open_connection(ADDRESS, 40923)
        await session.clock.advance(1.037)
        for line in (b"command;", b"chassis speed x 0.3;"):
            writer.write(line)
            assert await reader.readuntil(b";") == b"ok;"
        await session.clock.advance(0.713)
        writer.close()
        await until_gone(session, "robomaster")
        await session.clock.advance(1.5)
        assert not session.runtime.fleet.robots["a"].actions.running()
    assert ways(await identical(tmp_path))[:2] == ["robomaster came", "robomaster gone"]


@pytest.mark.slow  # like test_a_text_client_hangs_up_while_it_drives
async def test_foxglove_drives_and_hangs_up(tmp_path: Path) -> None:
    wish = {"linear": {"x": 0.3, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.2}}
    async with begun(tmp_path, foxglove={"enabled": True}) as session:
        await session.clock.advance(1.037)
        socket = await connect(f"ws://{ADDRESS}:8765", subprotocols=[Subprotocol("foxglove.sdk.v1")], max_size=None)
        channels: list[dict[str, Any]] = []
        while not channels:
            message = await socket.recv()
            channels = json.loads(message).get("channels", []) if isinstance(message, str) else []
        heard = 0

        async def send(message: str | bytes) -> None:
            nonlocal heard
            heard += 1
            await socket.send(message)
            await session.until_heard("foxglove", Direction.REPLY, heard)

        wanted = [
            {"id": channel["id"], "channelId": channel["id"]} for channel in channels if "cam" not in channel["topic"]
        ]
        await send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        publish = {"id": 7, "topic": "/a/cmd_vel", "encoding": "json", "schemaName": "geometry_msgs/Twist"}
        await send(json.dumps({"op": "advertise", "channels": [publish]}))
        await session.clock.advance(0.311)
        for _ in range(3):
            await send(struct.pack("<BI", 1, 7) + json.dumps(wish).encode())
            await session.clock.advance(0.2)
        await send(json.dumps({"op": "getParameters", "parameterNames": [], "id": "x"}))
        assert session.runtime.fleet.robots["a"].actions.running()
        await socket.close()
        await until_gone(session, "foxglove")
        await session.clock.advance(1.5)
    recording = await identical(tmp_path)
    assert ways(recording)[:2] == ["foxglove came", "foxglove gone"]
    assert len(recording.of(door="foxglove")) == 12


@pytest.mark.slow  # like test_a_text_client_hangs_up_while_it_drives
async def test_ros2_drives(tmp_path: Path) -> None:
    pytest.importorskip("zenoh", reason="needs roboglot[ros2]")
    rosbags = pytest.importorskip("rosbags.typesys", reason="needs roboglot[ros2]")
    store = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY)
    kinds = {name: store.types[f"geometry_msgs/msg/{name}"] for name in ("Twist", "Vector3")}
    still = kinds["Vector3"](0.0, 0.0, 0.0)
    twist = kinds["Twist"](kinds["Vector3"](0.3, 0.0, 0.0), still)
    data = bytes(store.serialize_cdr(twist, "geometry_msgs/msg/Twist"))
    async with begun(tmp_path, ros2={"enabled": True}) as session:
        await session.clock.advance(1.037)
        door: Any = session.runtime.doors["a"].door("ros2")
        for number in range(3):
            door.receive("cmd_vel", data if number else b"no CDR")
            await session.until_heard("ros2", Direction.REPLY, number + 1)
            await session.clock.advance(0.217)
        await session.clock.advance(1.0)
        assert session.runtime.fleet.robots["a"].actions.running() == []
    recording = await identical(tmp_path)
    assert [e.status for e in recording.of(door="ros2") if e.direction is Direction.REPLY] == ["refused", "ok", "ok"]


@pytest.mark.slow
async def test_an_app_calls_off_what_it_asked(tmp_path: Path) -> None:
    async with begun(tmp_path) as session:
        session.dog = session.new_app()
        await session.dog.open()
        await session.dog_asks(10001)
        await session.clock.advance(1.5)
        await session.dog_asks(1004, motion_id=130)
        await session.clock.advance(0.7)
        for task in tuple(session.tasks):
            task.cancel()
        await until_gone(session, "cyberdog")
        await session.clock.advance(1.0)
        await session.dog.close()
        await session.clock.advance(1.0)
    assert "cyberdog called off" in ways(await identical(tmp_path))


@pytest.mark.slow  # like test_a_text_client_hangs_up_while_it_drives
async def test_a_front_end_hangs_up_and_comes_again(tmp_path: Path) -> None:
    source = "cyberdog.task.block('one')\ntime.sleep(2)\ncyberdog.task.block('two')\n"
    async with begun(tmp_path) as session:
        await session.clock.advance(1.037)
        for operate in ("save", "run", "inquiry"):
            async with connect(f"ws://{ADDRESS}:50053/programs") as socket:
                await session.frame(socket, operate, source if operate == "save" else "")
                await session.clock.advance(0.5)
            await until_gone(session, "visual", ("save", "run", "inquiry").index(operate) + 1)
            await session.clock.advance(0.311)
        await session.clock.advance(2.0)
    assert ways(await identical(tmp_path)).count("visual gone") == 3


@pytest.mark.slow  # like test_an_app_calls_off_what_it_asked
async def test_a_teacher_stops_and_locks(tmp_path: Path) -> None:
    source = "for n in range(99):\n    cyberdog.task.block('b%d' % n)\n    time.sleep(0.3)\n"
    async with begun(tmp_path) as session:
        await session.clock.advance(1.037)
        desk = session.runtime.build_desk()
        async with connect(f"ws://{ADDRESS}:50053/programs") as socket:
            await session.frame(socket, "save", source)
            await session.clock.advance(0.5)
            for _ in range(2):
                await session.frame(socket, "run")
                await session.clock.advance(1.1)
                await asyncio.gather(program_runs.end_all(desk, "a"), session.clock.advance(0.5))
            classes = Classes(
                desk, Classroom(), lambda name: program_runs.end_all(desk, name), set, lambda _: asyncio.sleep(0)
            )
            await asyncio.gather(classes._do_with("lock", "a"), session.clock.advance(0.5))
            await session.rest.get_pose()
            await classes._do_with("unlock", "a")
            await session.clock.advance(0.5)
    recording = await identical(tmp_path)
    names = [given.name for _, given in recording.inputs if given.kind in ("program", "lease")]
    assert names == ["end", "end", "give", "end", "release"]  # locked before its program ends: none starts in between


async def test_unrepeatable_recordings_are_refused(tmp_path: Path) -> None:
    async with begun(tmp_path) as session:
        await session.clock.advance(0.5)
        await session.rest.get_pose()
    recording = read_recording(tmp_path / "r.mcap")
    values = json.loads(recording.attachments["config.json"])
    for section, wrong, word in (
        ("vda5050", {"broker": "localhost"}, "broker"),
        ("visual", {"cloud": "http://127.0.0.1:1"}, "cloud"),
    ):
        broken = values | {"doors": values["doors"] | {section: wrong}}
        attached = recording.attachments | {"config.json": json.dumps(broken).encode()}
        with pytest.raises(NoRerun, match=word):
            configuration(dataclasses.replace(recording, attachments=attached), tmp_path)
    for damaged in (b"", b"[]", b"{}", b"[" * 100_000, b'{"world": 1}', b'{"world": "empty", "doors": []}'):
        attached = recording.attachments | {"config.json": damaged}
        with pytest.raises(NoRerun, match="lacks its configuration"):
            configuration(dataclasses.replace(recording, attachments=attached), tmp_path)
    with pytest.raises(NoRerun, match=r"begins 12\.0 s after"):
        configuration(dataclasses.replace(recording, first=recording.first + 12_000_000_000), tmp_path)
    far = json.dumps(values | {"database": "postgresql://far/away", "registry": "far.db"}).encode()
    alone = configuration(
        dataclasses.replace(recording, attachments=recording.attachments | {"config.json": far}), tmp_path
    )
    assert (alone.database, alone.registry) == ("", "")
    assert reasons(recording) == []
    asked = next(e for e in recording.exchanges if e.direction is Direction.REQUEST)
    recording.exchanges.append(asked._replace(payload=b'{"password": "[redacted]"}'))
    recording.facts["data"] = "kept"
    assert [why.split()[0] for why in reasons(recording)] == ["the", "1"]


async def test_a_door_without_a_way_is_named(tmp_path: Path) -> None:
    """No protocol in a recording raises KeyError."""
    async with begun(tmp_path) as session:
        await session.rest.get_pose()
        recording = Recording(tmp_path)
        request = ("vda5050", "broker:1883", "", Direction.REQUEST, "order", b"{}")
        recording.exchanges.append(Exchange(0.1, "a", *request))
        inputs = Inputs(recording, session.clock, lambda _place: None, lambda _given: asyncio.sleep(0))
        await inputs.play(0.2)
    assert inputs.unheard == ["a client of vda5050, whose messages cannot be repeated, at 0.100"]
