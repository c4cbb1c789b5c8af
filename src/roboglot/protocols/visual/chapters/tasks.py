"""Frames of type task (0.2.1.1.2.2.1): which operation of the service each is, and how many answers it gets."""

from __future__ import annotations

from roboglot.operations import Right
from roboglot.programs.errors import ProgramError
from roboglot.programs.tasks.states import TaskOperation
from roboglot.protocols.visual.context import Context
from roboglot.protocols.visual.errors import state_of
from roboglot.protocols.visual.table import TABLE
from roboglot.protocols.visual.vocabulary import item, program


@TABLE.on("task save", right=Right.PROGRAM)
async def save(context: Context) -> None:
    """Save a task. Raises ProgramError for a refusal of the whole frame, as do all handlers here."""
    await context.service.save(program(context.request))
    await context.answers.accept()


@TABLE.on("task debug", right=Right.PROGRAM)
async def debug(context: Context) -> None:
    """Run a task without saving it."""
    await context.service.debug(program(context.request))
    await context.answers.accept()


@TABLE.on("task run", right=Right.PROGRAM)
async def run(context: Context) -> None:
    """Run a saved task, now or when its condition is due; only the first target counts, as in ``save``."""
    request = context.request
    await context.service.run(request.targets[0], request.mode, request.condition)
    await context.answers.accept()


@TABLE.on("task inquiry", right=Right.SEE)
async def inquire(context: Context) -> None:
    """List the tasks."""
    context.answers.list([item(task) for task in await context.service.tasks(context.request.targets)])


@TABLE.on("task suspend", "task recover", "task shutdown", right=Right.PROGRAM)
async def control(context: Context) -> None:
    """Send two feedbacks: one for the request and, by the service, one when each task has done it."""
    service, answers = context.service, context.answers
    operation = TaskOperation(context.request.operate)
    legal = []
    for id in context.request.targets:
        if (refusal := await service.refusal(operation, id)) is None:
            legal.append(id)
        else:
            answers.refuse(state_of(refusal), str(refusal), id)
    if legal:
        await answers.accept(legal[0])
    if operation is TaskOperation.SHUTDOWN:  # no task may continue while another is awaited
        for id, late in (await service.shutdown(legal)).items():
            answers.refuse(state_of(late), str(late), id)
        return
    obey = service.suspend if operation is TaskOperation.SUSPEND else service.recover
    for id in legal:
        try:
            await obey(id)
        except ProgramError as late:  # it ended after the first feedback
            answers.refuse(state_of(late), str(late), id)


@TABLE.on("task delete", right=Right.PROGRAM)
async def delete(context: Context) -> None:
    """Remove tasks; one feedback per target."""
    for id in context.request.targets:
        try:
            await context.service.delete(id)
        except ProgramError as refusal:
            context.answers.refuse(state_of(refusal), str(refusal), id)
        else:
            await context.answers.accept(id)
