"""What the studio needs of one robot's block programs, handed in by who joins doors and console."""

from __future__ import annotations

from dataclasses import dataclass

from roboglot.model.robot import Robot
from roboglot.programs.tasks.service import ProgramService
from roboglot.wire.visual.relay import FrameRelay


@dataclass(frozen=True, slots=True)
class Programs:
    """One robot's: ``frames`` takes front ends' frames, ``service`` is what they reach."""

    robot: Robot
    frames: FrameRelay
    service: ProgramService
