"""Gives a robot the skills that its parts allow, and starts what they need. Knows no algorithm."""

from __future__ import annotations

import asyncio
import importlib
import logging

from roboglot.autonomy.belief import Belief
from roboglot.autonomy.driving import OdometryDriving
from roboglot.autonomy.localization import LidarLocalization
from roboglot.autonomy.mapping import LidarMapping
from roboglot.model.components.base import Base
from roboglot.model.components.driving import Driving
from roboglot.model.components.lidar import Lidar
from roboglot.model.components.localization import Localization
from roboglot.model.components.mapping import Mapping
from roboglot.model.components.odometry import Odometry
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)


class Autonomy:
    """Adds Driving, and with a Lidar Localization, Mapping, Navigation and Docking, to ``robot``."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._belief: Belief | None = None
        self._loading: asyncio.Task[None] | None = None
        self._slam: object = None
        if Base not in robot or Odometry not in robot:
            return
        robot.add(Driving, OdometryDriving(robot))
        if Lidar not in robot:
            return
        self._belief = belief = Belief(robot[Odometry])
        robot.add(Localization, LidarLocalization(robot, belief))
        robot.add(Mapping, LidarMapping(robot, belief))

    @property
    def ready(self) -> bool:
        """Whether the kernels are loaded: before, localization is odometry, there is no map and navigation waits."""
        return self._slam is not None

    async def start(self, *, wait: bool) -> None:
        """Load the kernels; return at once, or with ``wait`` when all is ready."""
        if self._belief is None or self._loading is not None:
            return
        self._loading = asyncio.create_task(self._load(self._belief), name=f"kernels for {self._robot.id}")
        if wait:
            await self._loading

    async def close(self) -> None:
        """Stop listening to the lidar."""
        if self._loading is not None:
            self._loading.cancel()
        if self._slam is not None:
            self._slam.close()  # type: ignore[attr-defined]

    async def _load(self, belief: Belief) -> None:
        """In a thread, because importing Numba takes a second and compiling, the first time, some more."""
        slam = await asyncio.to_thread(importlib.import_module, "roboglot.autonomy.slam")
        self._slam = slam.Slam(self._robot, belief)
