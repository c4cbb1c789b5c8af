"""First argument of all handlers of frames."""

from __future__ import annotations

from roboglot.model.robot import Robot
from roboglot.programs.library.library import ModuleLibrary
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.answers import Answers
from roboglot.values import dataclass
from roboglot.wire.visual.requests import Request


@dataclass(frozen=True, slots=True)
class Context:
    """One request, the programs of its robot, and the sender of its answers."""

    service: ProgramService
    request: Request
    answers: Answers

    @property
    def robot(self) -> Robot:
        """The robot that runs the programs."""
        return self.service.robot

    @property
    def library(self) -> ModuleLibrary:
        """The robot's modules."""
        return self.service.library
