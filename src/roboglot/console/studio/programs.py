"""Parts that the studio is given: programs of robots, a copy of the world to rehearse in, missions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from roboglot.console.studio.lessons import FOLDER, Lesson, load
from roboglot.model.robot import Robot
from roboglot.programs.rehearsing import Rehearse, SceneOf
from roboglot.programs.tasks.service import ProgramService
from roboglot.wire.visual.relay import FrameRelay


@dataclass(frozen=True, slots=True)
class Programs:
    """One robot's: ``frames`` takes front ends' frames, ``service`` is what they reach."""

    robot: Robot
    frames: FrameRelay
    service: ProgramService


@dataclass(frozen=True, slots=True)
class ClassHome:
    """Socket of the classroom that several worlds share, and the name of this world there."""

    path: Path
    world: str


@dataclass(frozen=True, slots=True)
class Studio:
    """One console's. ``folders``: of missions, read at every look, so that a teacher sees a new one at once.

    ``classes``: the folder of what is handed in; ``home``: the classroom is elsewhere, and so is that folder.
    """

    programs: Mapping[str, Programs] = field(default_factory=dict)
    rehearse: Rehearse | None = None
    scene_of: SceneOf | None = None
    folders: Sequence[Path] = (FOLDER,)
    classes: Path | None = None
    home: ClassHome | None = None

    def lessons(self) -> dict[str, Lesson]:
        """All missions by their names."""
        return load(self.folders)
