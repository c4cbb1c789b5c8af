"""Progress of one drive over all its tries."""

from __future__ import annotations

import math

from roboglot.model.actions import Action
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.events import RobotBlocked
from roboglot.model.robot import Robot
from roboglot.values import dataclass

BLOCKED_SECONDS = 180.0  # s of waiting before BaseBlocked is published


@dataclass(slots=True)
class DriveProgress:
    """Progress of one drive: goals passed, and time spent before obstacles.

    ``obeyed``: annotations at the time of the last way over known floor, None before the first: an obstacle that closes
    it later has come, and may go again.
    """

    passed: int = 0
    obeyed: Annotations | None = None
    far: float = 0.0  # m driven
    far_max: float = math.inf  # m that it may drive; finite once the way leads through unknown floor
    closed_since: float = math.inf  # since when an obstacle has stood on a way over known floor
    since: float = math.inf
    published: bool = False

    def waits(self, robot: Robot, action: Action) -> None:
        """Note that the robot waits; publish RobotBlocked once after a long time."""
        now = robot.clock.time()
        self.since = min(self.since, now)
        if now - self.since >= BLOCKED_SECONDS and not self.published:
            self.published = True
            robot.events.publish(RobotBlocked(stamp=now, action=action, seconds=now - self.since))
