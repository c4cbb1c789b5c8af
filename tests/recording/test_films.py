"""Films in recordings of real robots: their video comes with their link, after the recording has begun."""

from __future__ import annotations

import json
from pathlib import Path
from typing import cast

import pytest

from roboglot.media.video import VideoPacket, VideoStream
from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.link import Link
from roboglot.model.feed import Feed
from roboglot.model.robot import Description, Robot
from roboglot.model.tap import Direction
from roboglot.recording.entries import Entry
from roboglot.recording.lines import Target
from roboglot.recording.proxy.relay import ExchangeWriter
from roboglot.recording.reader import read_recording
from roboglot.recording.sampler import Sampler
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

PLATE = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.25, height=0.3)


class FarCamera:
    """A real robot's stream as a driver has it; ``say`` is what comes over its link."""

    def __init__(self) -> None:
        self.watched = False
        self._feed: Feed[VideoPacket] = Feed(self._begin, self._end, queue_max=8)
        self.subscribe = self._feed.subscribe

    def say(self, data: bytes) -> None:
        self._feed.push(VideoPacket(0.0, data, True))

    def _begin(self) -> None:
        self.watched = True

    def _end(self) -> None:
        self.watched = False


async def test_real_robot_video_is_recorded_as_it_comes() -> None:
    clock, noted = LockstepClock(), list[Entry]()
    robot = Robot("a", PLATE, clock)
    sampler = Sampler(robot, noted.append, video=True)
    await clock.advance(2.5)  # its link is not up yet
    camera = FarCamera()
    robot.add(VideoStream, cast(VideoStream, camera))
    await clock.advance(1.0)
    assert camera.watched
    camera.say(b"first")
    await clock.advance(0.1)
    camera.say(b"second")
    await clock.advance(0.1)
    assert [(entry.topic, entry.kind, entry.value) for entry in noted] == [
        ("/a/camera", "video", ("a/camera", b"first")),
        ("/a/camera", "video", ("a/camera", b"second")),
    ]
    sampler.close()
    await clock.advance(0.1)
    assert not camera.watched


@pytest.mark.parametrize("photos", [False, True])
@pytest.mark.parametrize("real", [False, True])
async def test_photos_of_real_robots_are_optional(real: bool, photos: bool) -> None:
    noted = list[Entry]()
    robot = Robot("a", PLATE, LockstepClock())
    if real:
        robot.add(Link, cast(Link, object()))
    sampler = Sampler(robot, noted.append, photos=photos)
    chunk = pb.FileChunk(file_name="x.jpg", file_size=9, buffer=b"some face")
    for door in ("cyberdog", "driver/cyberdog"):
        robot.tap.reply(door, "4002", chunk.SerializeToString(), "ok")
        robot.tap.reply(door, "4002", '{"result": 0}', "ok")
        robot.tap.reply(door, "1004", chunk.SerializeToString(), "ok")
    sampler.close()
    said = [entry.value.payload for entry in noted]
    kept = b"some face" if photos or not real else bytes(9)
    assert [pb.FileChunk.FromString(said[n]).buffer for n in (0, 3)] == [kept, kept]
    assert [pb.FileChunk.FromString(said[n]).file_name for n in (0, 3)] == ["x.jpg", "x.jpg"]
    assert said[1] == b'{"result": 0}'
    assert b"some face" in said[2]  # no photo


async def test_the_proxy_leaves_out_photos_and_named_fields(tmp_path: Path) -> None:
    chunk = pb.FileChunk(buffer=b"some face").SerializeToString()
    for photos in (False, True):
        path = tmp_path / f"{photos}.mcap"
        writer = ExchangeWriter(path, Target("cyberdog://127.0.0.1"), "0", redact=["room"], photos=photos)
        writer.note("127.0.0.1:5", Direction.REPLY, "4004", chunk, "ok", None)
        writer.note("127.0.0.1:5", Direction.REQUEST, "6001", b'{"room": "bath", "token": "x"}', "", None)
        writer.close()
        picture, words = [exchange.payload for exchange in read_recording(path).exchanges]
        assert (b"some face" in picture) is photos
        assert json.loads(words) == {"room": "[redacted]", "token": "[redacted]"}
