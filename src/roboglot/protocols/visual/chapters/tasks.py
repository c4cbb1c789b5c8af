"""Frames of type task (0.2.1.1.2.2.1): which operation of the service each is, and how many answers it gets."""

from __future__ import annotations

from roboglot.programs.errors import ProgramError
from roboglot.programs.tasks.service import ProgramService
from roboglot.programs.tasks.states import TaskOperation
from roboglot.protocols.visual.answers import Answers, item, program
from roboglot.protocols.visual.errors import state_of
from roboglot.wire.visual.requests import Request


async def answer(service: ProgramService, request: Request, answers: Answers) -> None:
    """Do what the frame asks; raises ProgramError for what concerns it as a whole."""
    match request.operate:
        case "save":
            await service.save(program(request))
            await answers.accept()
        case "debug":
            await service.debug(program(request))
            await answers.accept()
        case "run":  # the first target counts, as in save
            await service.run(request.targets[0], request.mode, request.condition)
            await answers.accept()
        case "suspend" | "recover" | "shutdown":
            await _control(service, request, answers)
        case "delete":
            await _delete(service, request, answers)
        case "inquiry":
            answers.list([item(task) for task in await service.tasks(request.targets)])


async def _control(service: ProgramService, request: Request, answers: Answers) -> None:
    """Two feedbacks: the first for the request, the second (from the service) when each task has really obeyed."""
    operation = TaskOperation(request.operate)
    legal = []
    for id in request.targets:
        if (refusal := await service.refusal(operation, id)) is None:
            legal.append(id)
        else:
            answers.refuse(state_of(refusal), str(refusal), id)
    if legal:
        await answers.accept(legal[0])
    if operation is TaskOperation.SHUTDOWN:  # none of them goes on while another one is waited for
        for id, late in (await service.shutdown(legal)).items():
            answers.refuse(state_of(late), str(late), id)
        return
    obey = service.suspend if operation is TaskOperation.SUSPEND else service.recover
    for id in legal:
        try:
            await obey(id)
        except ProgramError as late:  # it ended between the first feedback and now
            answers.refuse(state_of(late), str(late), id)


async def _delete(service: ProgramService, request: Request, answers: Answers) -> None:
    """One feedback per target."""
    for id in request.targets:
        try:
            await service.delete(id)
        except ProgramError as refusal:
            answers.refuse(state_of(refusal), str(refusal), id)
        else:
            await answers.accept(id)
