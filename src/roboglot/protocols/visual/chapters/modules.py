"""Frames of type module (0.2.1.1.2.2.2): functions that tasks and other modules call by their interface."""

from __future__ import annotations

from roboglot.operations import Right
from roboglot.programs.errors import ProgramError
from roboglot.protocols.visual.context import Context
from roboglot.protocols.visual.errors import state_of
from roboglot.protocols.visual.table import TABLE
from roboglot.protocols.visual.vocabulary import item, program


@TABLE.on("module save", right=Right.PROGRAM)
async def save(context: Context) -> None:
    """Save a module. Raises ProgramError for a refusal of the whole frame, as do all handlers here."""
    await context.library.save(program(context.request))
    await context.answers.accept()


@TABLE.on("module delete", right=Right.PROGRAM)
async def delete(context: Context) -> None:
    """Remove modules; one feedback per target."""
    for id in context.request.targets:
        try:
            await context.library.delete(id)
        except ProgramError as refusal:
            context.answers.refuse(state_of(refusal), str(refusal), id)
        else:
            await context.answers.accept(id)


@TABLE.on("module inquiry", right=Right.SEE)
async def inquire(context: Context) -> None:
    """List the modules."""
    context.answers.list([item(module) for module in await context.library.modules(context.request.targets)])
