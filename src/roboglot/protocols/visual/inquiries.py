"""Frames of type AI and SLAM (0.2.1.1.2.2.3 and following): what the robot knows besides programs."""

from __future__ import annotations

from roboglot.model.components.map_library import MapLibrary
from roboglot.model.errors import RobotError
from roboglot.programs.reports import Refusal
from roboglot.programs.service import ProgramService
from roboglot.programs.tasks import TaskOperation
from roboglot.protocols.visual.answers import Answers
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.requests import Kind, Request


async def answer(service: ProgramService, request: Request, answers: Answers) -> None:
    """List the saved maps; people, words and preset points are not built."""
    service.allow(TaskOperation.INQUIRY)
    if (request.kind, request.mode) != (Kind.SLAM, "map"):
        raise Refusal(FeedbackState.OTHER, f"the inquiry of {request.kind} {request.mode} is not built yet")
    try:
        names = await service.robot[MapLibrary].names()
    except RobotError as error:
        raise Refusal(FeedbackState.OTHER, str(error)) from None
    wanted = [name for name in sorted(names) if not request.targets or name in request.targets]
    # The vendor's robots make outdoor maps with cameras; what the lidar made is an indoor one.
    answers.list([{"id": n, "mode": "map", "style": "[]", "condition": "indoor", "describe": n} for n in wanted])
