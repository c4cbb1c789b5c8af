"""The camera, stream and audio chapters (manual 3.2.16 to 3.2.18); media_port.py has the bytes."""

from __future__ import annotations

from roboglot.media.audio import AudioStream
from roboglot.media.video import VideoStream
from roboglot.model.components.sensing.camera import Camera
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import Exposure
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.vocabulary import EXPOSURES


@TABLE.on("camera exposure", right=Right.DRIVE, needs=(Camera,))
def expose(context: Context, ev_level: Exposure) -> None:
    """Set the picture's exposure (3.2.16.1); default again when the session ends."""
    camera = context.robot[Camera]
    camera.set_exposure(EXPOSURES[ev_level])
    context.at_end("camera exposure", lambda: camera.set_exposure(EXPOSURES["default"]))


@TABLE.on("stream on", right=Right.SEE, needs=(VideoStream,))
def stream_on(context: Context) -> None:
    """Start H.264 to all clients of the video port (3.2.17.1); no effect if started."""
    context.robot.require(VideoStream)
    context.outlets.video.switch(True)
    context.at_end("stream", lambda: context.outlets.video.switch(False))


@TABLE.on("stream off", right=Right.SEE)
def stream_off(context: Context) -> None:
    """Stop the video; connections stay open (3.2.17.2)."""
    context.outlets.video.switch(False)


@TABLE.on("audio on", right=Right.SEE, needs=(AudioStream,))
def audio_on(context: Context) -> None:
    """Start Opus to all clients of the audio port (3.2.18.1); no effect if started."""
    context.robot.require(AudioStream)
    context.outlets.audio.switch(True)
    context.at_end("audio", lambda: context.outlets.audio.switch(False))


@TABLE.on("audio off", right=Right.SEE)
def audio_off(context: Context) -> None:
    """Stop the audio; connections stay open (3.2.18.2)."""
    context.outlets.audio.switch(False)
