"""Playback of a recording: play, pause, speed, seek."""

from __future__ import annotations

import math

from roboglot.model.errors import InvalidGoal, NotReady
from roboglot.operations import Right
from roboglot.protocols.foxglove.channels import PlaybackCommand
from roboglot.protocols.foxglove.context import Context
from roboglot.protocols.foxglove.table import TABLE

PLAY, PAUSE = 0, 1
SPEED_MIN, SPEED_MAX = 0.01, 100.0


@TABLE.on("playbackControlRequest", right=Right.SEE)
async def control(context: Context, *, command: int, speed: float, seek: int | None = None, request: str = "") -> None:
    """Play or pause, at this speed, from ``seek`` (ns since 1970) if given; for all clients at once."""
    await context.joined.wait()
    if context.topics is None:
        raise NotReady("there are no topics to play")
    if command not in (PLAY, PAUSE):
        raise InvalidGoal(f"a playback command must be 0 (play) or 1 (pause), not {command}")
    if not math.isfinite(speed) or not SPEED_MIN <= speed <= SPEED_MAX:
        raise InvalidGoal(f"a recording is played {SPEED_MIN:g} to {SPEED_MAX:g} times as fast, not {speed:g}")
    context.topics.control(context, PlaybackCommand(command == PLAY, speed, seek, request))
