"""Docking by the dog's own skill (6004 type 9)."""

from __future__ import annotations

from roboglot.drivers.cyberdog.chapters.mapping.tasks import Skills
from roboglot.drivers.linked_base import OFF_DOCK
from roboglot.model.actions import Action
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Refused
from roboglot.model.geometry import Pose


class CyberDogDocking(Docking):
    """Docking by task 6004, type 9."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    @property
    def home(self) -> Pose | None:
        return None

    def set_home(self, pose: Pose | None) -> None:
        raise Refused("this robot finds its dock by itself")

    def dock(self, *, source: str = "") -> Action:
        charge = self._skills.client.charge
        return self._skills.start_from_idle("dock", charge, goal=None, source=source)

    def undock(self, *, source: str = "") -> Action:
        if not self._skills.reported.docked:
            raise Refused("the robot is not on a dock")
        return self._skills.robot[Driving].move_by(Pose(OFF_DOCK), source=source)
