"""The camera, stream and audio chapters (manual 3.2.16 to 3.2.18); media_port.py has the bytes."""

from __future__ import annotations

from roboglot.model.components.sensing.camera import Camera
from roboglot.operations import Right
from roboglot.protocols.robomaster.ranges import Exposure
from roboglot.protocols.robomaster.session import Session
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.vocabulary import EXPOSURES


@TABLE.on("camera exposure", right=Right.DRIVE, needs=(Camera,))
async def expose(session: Session, ev_level: Exposure) -> None:
    """How bright the picture is (3.2.16.1); default again when the session ends."""
    camera = session.robot[Camera]
    camera.set_exposure(EXPOSURES[ev_level])
    session.at_end("camera exposure", lambda: camera.set_exposure(EXPOSURES["default"]))


@TABLE.on("stream on", right=Right.SEE)
async def stream_on(session: Session) -> None:
    """Let the video port send H.264 to all who are connected (3.2.17.1); twice is no matter."""
    session.outlets.video.switch(True)
    session.at_end("stream", lambda: session.outlets.video.switch(False))


@TABLE.on("stream off", right=Right.SEE)
async def stream_off(session: Session) -> None:
    """Stop it; connections stay (3.2.17.2)."""
    session.outlets.video.switch(False)


@TABLE.on("audio on", right=Right.SEE)
async def audio_on(session: Session) -> None:
    """Let the audio port send Opus to all who are connected (3.2.18.1); twice is no matter."""
    session.outlets.audio.switch(True)
    session.at_end("audio", lambda: session.outlets.audio.switch(False))


@TABLE.on("audio off", right=Right.SEE)
async def audio_off(session: Session) -> None:
    """Stop it; connections stay (3.2.18.2)."""
    session.outlets.audio.switch(False)
