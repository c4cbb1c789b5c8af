"""Films in recordings of real robots: their video comes with their link, after the recording has begun."""

from __future__ import annotations

from typing import cast

from roboglot.media.video import VideoPacket, VideoStream
from roboglot.model.clock import LockstepClock
from roboglot.model.feed import Feed
from roboglot.model.robot import Description, Robot
from roboglot.recording.entries import Entry
from roboglot.recording.sampler import Sampler


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
    plate = Description(
        maker="", model="", serial="", hardware_version="", software_version="", radius=0.25, height=0.3
    )
    robot = Robot("a", plate, clock)
    sampler = Sampler(robot, noted.append, video=True)
    await clock.advance(2.5)  # its link is not there yet
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
