"""A recorded robot's file is played to viewers: from the beginning, paused, faster, from another moment."""

from __future__ import annotations

import dataclasses
import json
import struct
import threading
from collections.abc import Callable, Collection
from pathlib import Path
from typing import NamedTuple

import httpx
import pytest
from mcap.records import Channel, Message, Metadata, Schema
from mcap.writer import Writer

from roboglot.config import RecordConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.protocols import DOORS, sections
from roboglot.recording.message_index import MessageIndex, TimedMessage
from roboglot.recording.reader import Recording, read_messages, read_recording, records
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.protocols.foxglove.conftest import ADDRESS, Opened, Scene, Viewer

SECOND = free_addresses(1)
NANO = 10**9
PLAYING, PAUSED, ENDED = 0, 1, 3
SECONDS = 20.0  # of the recording


class State(NamedTuple):
    """State of playback as the server reports it."""

    status: int
    time: int
    speed: float
    sought: bool
    request: str


@pytest.fixture(scope="session")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twenty seconds of two robots, one of which turns."""
    folder = tmp_path_factory.mktemp("film")
    return folder / "film.mcap"


def copied(film: Path, copy: Path, *, whole: bool = True) -> Path:
    """Copy it, in small chunks; or leave away the second half of these."""
    with copy.open("wb") as file:
        writer = Writer(file, chunk_size=10_000)
        writer.start()
        schemas, channels = dict[int, int](), dict[int, int]()
        for record, _, _ in records(film):
            match record:
                case Metadata():
                    writer.add_metadata(record.name, record.metadata)
                case Schema():
                    schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
                case Channel():
                    schema = schemas[record.schema_id]
                    channels[record.id] = writer.register_channel(record.topic, record.message_encoding, schema)
                case Message():
                    number = channels[record.channel_id]
                    writer.add_message(number, record.log_time, record.data, record.publish_time)
        writer.finish()
    if not whole:
        data = copy.read_bytes()
        copy.write_bytes(data[: len(data) // 2])
    return copy


def is_there(film: Path) -> bool:
    return film.exists()


async def filmed(film: Path) -> Recording:
    """Make it, the first time."""
    if not is_there(film):
        places = {"a": ADDRESS, "b": SECOND}
        robots = [{"name": name, "body": "universal", "address": place} for name, place in places.items()]
        values = {"data": str(film.parent / "data"), "world": "empty", "lockstep": True, "robots": robots}
        config = load_config(None, values | {"console": {"enabled": False}}, sections())
        doors = tuple(door for door in DOORS if door.name == "slamware")
        runtime = Runtime(dataclasses.replace(config, record=RecordConfig(to=str(film))), doors)
        await runtime.start()
        for place in places.values():
            async with httpx.AsyncClient(base_url=f"http://{place}:1448", verify=False) as client:
                assert (await client.get("/api/core/system/v1/power/status")).status_code == 200
        assert isinstance(runtime.clock, LockstepClock)
        await runtime.clock.advance(SECONDS)
        await runtime.close()
    return read_recording(film)


@pytest.fixture
async def playing(film: Path, opened: Opened) -> Scene:
    await filmed(film)
    return await opened(robots=[{"name": "a", "body": f"recording:{film}#a", "address": ADDRESS}])


def states(viewer: Viewer) -> list[State]:
    """Playback states sent by the server."""
    found = []
    for data in viewer.binary:
        assert data[0] == 5
        _, status, time, speed, sought, length = struct.unpack_from("<BBQf?I", data)
        found.append(State(status, time, speed, sought, data[19 : 19 + length].decode()))
    return found


async def ask(viewer: Viewer, command: int, speed: float = 1.0, seek: int | None = None, request: str = "r") -> State:
    """Control it, and return the answer."""
    before = len(viewer.binary)
    name = request.encode()
    head = struct.pack("<BBfBQI", 3, command, speed, seek is not None, seek or 0, len(name))
    await viewer.socket.send(head + name)
    await viewer.until(lambda: len(viewer.binary) > before)
    return states(viewer)[-1]


def recorded(film: Path, topic: str, which: Callable[[int], bool] = lambda _: True) -> list[tuple[int, bytes]]:
    """Return the file's messages of a topic."""
    return [(record.at, record.data) for record in read_messages(film, topic) if which(record.at)]


@pytest.mark.slow
async def test_says_what_there_is_and_begins(playing: Scene, film: Path) -> None:
    recording = await filmed(film)
    viewer = await playing.connect()
    await viewer.until(lambda: states(viewer))
    (info,) = viewer.said["serverInfo"]
    assert {"playbackControl", "time"} <= set(info["capabilities"])
    assert "clientPublish" not in info["capabilities"]
    for key, at in (("dataStartTime", recording.first), ("dataEndTime", recording.last)):
        assert info[key]["sec"] * NANO + info[key]["nsec"] == at
    assert states(viewer)[0] == State(PLAYING, recording.first, 1.0, False, "")
    shown = {topic for topic in recording.topics if not topic.startswith(("/b/", "/truth/b/"))}
    assert set(viewer.channels) == shown
    assert {"/a/scan", "/a/pose", "/tf", "/truth/a/pose"} <= shown


async def test_every_message_comes_once_in_its_order(playing: Scene, film: Path) -> None:
    viewer = await playing.connect()
    await viewer.topic("/a/pose")
    await ask(viewer, PAUSED, seek=0)
    poses, scans = await viewer.subscribe("/a/pose"), await viewer.subscribe("/a/scan")
    await viewer.settled()
    await ask(viewer, PLAYING, seek=0)
    await viewer.until(lambda: states(viewer)[-1].status == ENDED, SECONDS + 3)
    assert viewer.data[poses] == recorded(film, "/a/pose")
    assert viewer.data[scans] == recorded(film, "/a/scan")
    assert states(viewer)[-1].time == (await filmed(film)).last


async def test_time_passes_at_wanted_speed_and_pauses(playing: Scene, film: Path) -> None:
    first = (await filmed(film)).first
    viewer = await playing.connect()
    number = await viewer.subscribe("/a/pose")
    await viewer.settled()
    assert await ask(viewer, PLAYING, 4.0, first, "four") == State(PLAYING, first, 4.0, True, "four")
    await playing.clock.advance(2.0)
    paused = await ask(viewer, PAUSED, 4.0)
    assert paused == State(PAUSED, first + 8 * NANO, 4.0, False, "r")
    due = recorded(film, "/a/pose", lambda at: at <= first + 8 * NANO)
    await viewer.until(lambda: viewer.data[number][-1][0] == due[-1][0])
    count = len(viewer.data[number])
    await playing.clock.advance(2.0)
    await viewer.settled()
    assert len(viewer.data[number]) == count
    assert viewer.times[-1] == first + 8 * NANO
    await ask(viewer, PLAYING)
    await playing.clock.advance(1.0)
    assert (await ask(viewer, PAUSED)).time == first + 9 * NANO
    after = recorded(film, "/a/pose", lambda at: first + 8 * NANO < at <= first + 9 * NANO)
    await viewer.until(lambda: viewer.data[number][-len(after) :] == after)
    assert len(viewer.data[number]) == count + len(after)


async def test_a_jump_shows_how_things_stood_then(playing: Scene, film: Path) -> None:
    recording = await filmed(film)
    viewer = await playing.connect()
    await viewer.topic("/a/body")
    await ask(viewer, PAUSED, seek=recording.first)
    numbers = {topic: await viewer.subscribe(topic) for topic in ("/a/body", "/a/pose", "/a/map", "/a/events")}
    await viewer.settled()
    viewer.data.clear()
    there = recording.first + 13 * NANO + 1
    assert (await ask(viewer, PAUSED, seek=there)).sought
    await viewer.until(lambda: {numbers[t] for t in ("/a/body", "/a/pose", "/a/map")} <= set(viewer.data))
    for topic in ("/a/body", "/a/pose", "/a/map"):
        assert viewer.data[numbers[topic]] == [recorded(film, topic, lambda at: at < there)[-1]]
    assert numbers["/a/events"] not in viewer.data  # events are no state
    late = await viewer.subscribe("/truth/a/pose")
    await viewer.until(lambda: viewer.data.get(late))
    assert viewer.data[late] == [recorded(film, "/truth/a/pose", lambda at: at < there)[-1]]
    assert (await ask(viewer, PAUSED, seek=2**63)).time == recording.last


async def test_many_jumps_at_once_are_one_read(playing: Scene, film: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = await filmed(film)
    viewer = await playing.connect()
    pose = await viewer.subscribe("/a/pose")
    await ask(viewer, PAUSED, seek=recording.first + NANO)
    there = recorded(film, "/a/pose", lambda at: at < recording.first + NANO)[-1][0]
    await viewer.until(lambda: there in [at for at, _ in viewer.data.get(pose, ())])  # or it comes among those below
    look, free, looks = MessageIndex.last, threading.Event(), list[int]()

    def slowly(index: MessageIndex, at: int, topics: Collection[int]) -> list[TimedMessage]:
        looks.append(at)
        assert free.wait(60)
        return look(index, at, topics)

    monkeypatch.setattr(MessageIndex, "last", slowly)
    for number in range(2, 18):
        assert (await ask(viewer, PAUSED, seek=recording.first + number * NANO)).sought
    viewer.data.clear()
    free.set()
    await viewer.until(lambda: viewer.data.get(pose))
    await viewer.settled()
    assert len(looks) <= 2  # the pending one and the last
    assert looks[-1] == recording.first + 17 * NANO - 1
    assert [at for at, _ in viewer.data[pose]] == [recorded(film, "/a/pose", lambda at: at <= looks[-1])[-1][0]]


async def test_all_clients_see_same_and_last_rewinds(playing: Scene, film: Path) -> None:
    first = (await filmed(film)).first
    one, other = await playing.connect(), await playing.connect()
    old = await playing.connect("foxglove.websocket.v1")
    await one.until(lambda: states(one))
    await other.until(lambda: states(other))
    assert (await ask(one, PAUSED, seek=first + 5 * NANO, request="mine")).request == "mine"
    await other.until(lambda: states(other)[-1].status == PAUSED)
    assert states(other)[-1] == State(PAUSED, first + 5 * NANO, 1.0, True, "")
    await old.topic("/a/pose")
    await old.settled()
    assert old.binary == []  # that subprotocol has no message for it
    for viewer in (one, other, old):
        await viewer.close()
    await playing.clock.advance(1.0)
    again = await playing.connect()
    await again.until(lambda: states(again))
    assert states(again)[0] == State(PLAYING, first, 1.0, False, "")


async def test_after_the_end_it_begins_anew(playing: Scene, film: Path) -> None:
    recording = await filmed(film)
    viewer = await playing.connect()
    await viewer.until(lambda: states(viewer))
    await ask(viewer, PLAYING, 1.0, recording.last)
    await viewer.until(lambda: states(viewer)[-1].status == ENDED, 1.0)
    assert (await ask(viewer, PAUSED)).status == ENDED
    assert await ask(viewer, PLAYING) == State(PLAYING, recording.first, 1.0, True, "r")


@pytest.mark.parametrize(
    ("command", "speed", "why"),
    [
        (7, 1.0, "0 (play) or 1 (pause)"),
        (0, 0.0, "times as fast"),
        (0, float("nan"), "times as fast"),
        (0, 1e6, "times as fast"),
    ],
)
async def test_invalid_playback_requests_are_refused(playing: Scene, command: int, speed: float, why: str) -> None:
    viewer = await playing.connect()
    await viewer.until(lambda: states(viewer))
    await viewer.socket.send(struct.pack("<BBfBQI", 3, command, speed, 0, 0, 0))
    await viewer.until(lambda: viewer.complaints)
    assert why in viewer.complaints[0]
    assert len(states(viewer)) == 1


async def test_a_live_robot_cannot_be_wound_back(scene: Scene) -> None:
    viewer = await scene.connect()
    await viewer.topic("/a/pose")
    await viewer.socket.send(struct.pack("<BBfBQI", 3, 1, 1.0, 0, 0, 0))
    await viewer.until(lambda: viewer.complaints)
    assert "live" in viewer.complaints[0]
    assert "playbackControl" not in json.dumps(viewer.said["serverInfo"])


async def test_broken_file_is_played_to_its_break(film: Path, opened: Opened, tmp_path: Path) -> None:
    recording = await filmed(film)
    cut = copied(film, tmp_path / "cut.mcap", whole=False)
    end = read_recording(cut).last
    assert end < recording.last
    scene = await opened(robots=[{"name": "a", "body": f"recording:{cut}#a", "address": ADDRESS}])
    viewer = await scene.connect()
    number = await viewer.subscribe("/a/pose")
    await ask(viewer, PLAYING, 10.0, 0)
    await viewer.until(lambda: states(viewer)[-1].status == ENDED, SECONDS)
    assert viewer.data[number] == recorded(cut, "/a/pose")
    assert states(viewer)[-1].time == end


async def test_file_that_is_gone_ends_it_in_words(film: Path, opened: Opened, tmp_path: Path) -> None:
    await filmed(film)
    copy = copied(film, tmp_path / "copy.mcap")
    scene = await opened(robots=[{"name": "a", "body": f"recording:{copy}#a", "address": ADDRESS}])
    copy.unlink()
    viewer = await scene.connect()
    await viewer.until(lambda: viewer.complaints)
    assert "the recording cannot be read" in viewer.complaints[0]
