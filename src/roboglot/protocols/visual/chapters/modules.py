"""Frames of type module (0.2.1.1.2.2.2): functions that tasks and other modules call by their interface."""

from __future__ import annotations

from roboglot.programs.errors import ProgramError
from roboglot.programs.library.library import ModuleLibrary
from roboglot.protocols.visual.answers import Answers, item, program
from roboglot.protocols.visual.errors import state_of
from roboglot.wire.visual.requests import Request


async def answer(library: ModuleLibrary, request: Request, answers: Answers) -> None:
    """Do what the frame asks; raises ProgramError for what concerns it as a whole."""
    match request.operate:
        case "save":
            await library.save(program(request))
            await answers.accept()
        case "delete":
            for id in request.targets:
                try:
                    await library.delete(id)
                except ProgramError as refusal:
                    answers.refuse(state_of(refusal), str(refusal), id)
                else:
                    await answers.accept(id)
        case "inquiry":
            answers.list([item(module) for module in await library.modules(request.targets)])
