"""The studio's parts: programs of robots, a copy of the world to rehearse in, missions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

from roboglot.model.robot import Robot
from roboglot.programs.rehearsing import Rehearse, SceneOf
from roboglot.programs.tasks.service import ProgramService
from roboglot.values import dataclass
from roboglot.wire.visual.relay import FrameRelay

if TYPE_CHECKING:
    from roboglot.console.studio.lessons import Lesson

FOLDER = Path(__file__).parent / "missions"  # examples/lessons is a link to this folder


@dataclass(frozen=True, slots=True)
class Programs:
    """Programs of one robot: ``frames`` takes front ends' frames for ``service``."""

    robot: Robot
    frames: FrameRelay
    service: ProgramService

    async def end_all(self, why: str) -> None:
        """End every program that runs, is held or is just being started; ``why`` is the last line of their logs."""
        for _ in range(2):  # the first waits for a start that is under way
            running = [figures.target_id for figures in self.service.running()]
            await self.service.shutdown(running, why=why)


@dataclass(frozen=True, slots=True)
class ClassHome:
    """Socket of the classroom that several worlds share, and the name of this world there."""

    path: Path
    world: str


@dataclass(frozen=True, slots=True)
class Studio:
    """Studio of one console. ``folders``: of missions, read at every use, so that new ones appear at once.

    ``classes``: folder of the hand-ins; ``home``: a classroom elsewhere, which has that folder, too.
    """

    programs: Mapping[str, Programs] = field(default_factory=dict)
    rehearse: Rehearse | None = None
    scene_of: SceneOf | None = None
    folders: Sequence[Path] = (FOLDER,)
    classes: Path | None = None
    home: ClassHome | None = None

    def lessons(self) -> dict[str, Lesson]:
        """Return all missions by name."""
        from roboglot.console.studio.lessons import load

        return load(self.folders)
