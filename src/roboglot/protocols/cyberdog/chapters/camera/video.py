"""Chapter "image transmission": the app's signals (4001); ``transmission`` answers them."""

from __future__ import annotations

import logging

from roboglot.media.video import VideoStream
from roboglot.model.components.sensing.camera import Camera
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.chapters.camera import BadSignal, read_signal
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.text import read_params

log = logging.getLogger(__name__)


@TABLE.on(Code.VIDEO, right=Right.SEE, needs=(Camera, VideoStream))
async def signal(call: Call) -> str:
    """Handle the app's offers, candidates and stops; the robot's own are pushes of the same code."""
    call.context.robot.require(Camera, VideoStream)
    try:
        call.context.video.take(read_signal(read_params(call.text)))
    except BadSignal as bad:
        log.info("4001 ignored: %s", bad)  # robots accept it silently and do nothing
    return ""
