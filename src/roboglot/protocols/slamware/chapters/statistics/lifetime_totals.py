"""Distance driven and time run over the robot's life: kept in the settings every half minute."""

from __future__ import annotations

import asyncio

from roboglot.model.clock import Timer
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot

TOTALS = "slamware.statistics"  # the setting that holds the last saved [metres, seconds]
KEEP_PERIOD = 30.0  # s that a crash may lose


class Totals:
    """Totals before this start, and those since; stored every half minute."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._before = (0.0, 0.0)  # what to add to the robot's own count, which goes on when the robot restarts
        self._timer: Timer | None = None
        self._keeping: asyncio.Task[object] | None = None

    def start(self) -> None:
        """Load the earlier totals and start saving them."""
        if Settings in self._robot:
            metres, seconds = self._robot[Settings].get(TOTALS, (0.0, 0.0))
            driven = self._robot[Odometry].reading.distance if Odometry in self._robot else 0.0
            self._before = (float(metres) - driven, float(seconds) - self._robot.clock.time())
            self._wait()

    async def close(self) -> None:
        """Save the totals a last time."""
        if self._timer is None:
            return
        self._timer.cancel()
        await self._keep()

    @property
    def metres(self) -> float:
        """Distance driven so far, m."""
        return self._before[0] + self._robot[Odometry].reading.distance

    @property
    def seconds(self) -> float:
        """Robot time so far, s."""
        return self._before[1] + self._robot.clock.time()

    def _wait(self) -> None:
        self._timer = self._robot.clock.call_later(KEEP_PERIOD, self._keep_soon)

    def _keep_soon(self) -> None:
        self._keeping = asyncio.get_running_loop().create_task(self._keep(), name="statistics")
        self._wait()

    async def _keep(self) -> None:
        metres = self.metres if Odometry in self._robot else self._before[0]
        await self._robot[Settings].keep(TOTALS, [round(metres, 3), round(self.seconds, 3)])
