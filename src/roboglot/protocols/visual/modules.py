"""Frames of type module (0.2.1.1.2.2.2): there are none yet, and that is what every answer says."""

from __future__ import annotations

from roboglot.programs.reports import Refusal
from roboglot.programs.service import ProgramService
from roboglot.programs.tasks import TaskOperation
from roboglot.protocols.visual.answers import Answers
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.requests import Request


def answer(service: ProgramService, request: Request, answers: Answers) -> None:
    """An inquiry finds nothing, deleting nothing is illegal (0.2.2.2: null x delete), saving is not built."""
    service.allow(TaskOperation(request.operate))
    match request.operate:
        case "inquiry":
            answers.list([])
        case "delete":
            for id in request.targets:
                answers.refuse(Refusal(FeedbackState.ILLEGAL, f"there is no module {id}"), id)
        case _:
            raise Refusal(FeedbackState.OTHER, "modules are not built yet")
