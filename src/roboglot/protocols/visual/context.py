"""First argument of every handler of a frame."""

from __future__ import annotations

from dataclasses import dataclass

from roboglot.model.robot import Robot
from roboglot.programs.library.library import ModuleLibrary
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.answers import Answers
from roboglot.wire.visual.requests import Request


@dataclass(frozen=True, slots=True)
class Context:
    """One request, the programs of the robot that it is about, and how it is answered."""

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
