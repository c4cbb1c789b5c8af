"""Adds a robot's streams of video and audio, shared by all doors."""

from __future__ import annotations

from roboglot.media.audio import AudioStream
from roboglot.media.recorder import Recorder
from roboglot.media.video import VideoStream
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.robot import Robot


def add_streams(robot: Robot) -> None:
    """Add ``VideoStream`` and ``Recorder`` to a robot with a camera, ``AudioStream`` to one with a microphone."""
    if Camera in robot:
        video = robot.add(VideoStream, VideoStream(robot[Camera], robot.clock))
        robot.add(Recorder, Recorder(video, robot.clock))
    if Microphone in robot:
        robot.add(AudioStream, AudioStream(robot[Microphone], robot.clock))
