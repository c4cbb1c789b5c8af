"""Shoves of robots without a lidar: acceleration that the wheels do not explain.

The difference of both accelerations, integrated twice with a leak, is the distance of a shove. The leaks bound the
accelerometer's constant error: blows are detected, slow pushes over seconds are not.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math

from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import RobotDisplaced
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
PERIOD = 0.02  # s between two readings; after a missed one, its period is unknown
SPEED_LEAK, WAY_LEAK = 0.5, 1.0  # s after which a third of the difference in speed, in distance, remains
SHOVED, OVER = 0.05, 0.03  # m at which a displacement begins and ends; hard driving stays below 0.035
MISSED = 1.5 * PERIOD  # s between two readings that mean that one is missing


class InertialDisplacement:
    """Publishes ``RobotDisplaced`` for a robot whose accelerometer reports means over the time between readings."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._imu, self._odometry = robot[Imu], robot[Odometry]
        self._task: asyncio.Task[None] | None = None
        self._stamp = -math.inf
        self._wheels = (0.0, 0.0)  # m/s in odom
        self._speed = (0.0, 0.0)  # m/s that only the accelerometer measured
        self._way = (0.0, 0.0)  # m
        self._farthest = 0.0  # m of the current displacement; 0 without one
        self._reported = False

    def start(self) -> None:
        """Begin to watch."""
        if self._task is None:
            self._task = asyncio.create_task(self._watch(), name=f"shoves of {self._robot.id}")

    def close(self) -> None:
        """Stop watching."""
        if self._task is not None:
            self._task.cancel()

    async def _watch(self) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            await self._robot.clock.sleep(self._pause())
            await self._robot.clock.keep_calling(self._look)

    def _look(self) -> float:
        """Take the newest reading; return the seconds until the next look."""
        shoved = self._check()
        if shoved is not None:
            log.warning("robot %s was displaced by about %.2f m", self._robot.id, shoved)
            self._robot.events.publish(RobotDisplaced(stamp=self._robot.clock.time(), distance=shoved))
        return self._pause()

    def _pause(self) -> float:
        """Return the pause between two looks: half the period of the readings, so that each is seen once."""
        return max(PERIOD / 2, self._imu.reading.stamp + MISSED - self._robot.clock.time())

    def _check(self) -> float | None:
        """Take the newest reading; return the distance of a shove (m) once it no longer grows, else None."""
        felt, odometry = self._imu.reading, self._odometry.reading
        seconds = felt.stamp - self._stamp
        if seconds <= 0.0:
            return None
        twist, heading = odometry.twist, odometry.pose.yaw
        wheels = _turned(twist.x, twist.y, heading)
        if seconds < MISSED:
            acceleration = _turned(felt.linear_acceleration.x, felt.linear_acceleration.y, heading)
            self._add(acceleration, wheels, seconds)
        self._stamp, self._wheels = felt.stamp, wheels
        way = math.hypot(*self._way)
        if way < OVER:
            self._farthest, self._reported = 0.0, False
        elif way > max(SHOVED, self._farthest):
            self._farthest = way
        elif self._farthest and not self._reported:
            self._reported = True
            return self._farthest
        return None

    def _add(self, acceleration: tuple[float, float], wheels: tuple[float, float], seconds: float) -> None:
        kept, remembered = math.exp(-seconds / SPEED_LEAK), math.exp(-seconds / WAY_LEAK)
        (vx, vy), (x, y), (ux, uy) = self._speed, self._way, self._wheels
        vx = (vx + acceleration[0] * seconds - (wheels[0] - ux)) * kept
        vy = (vy + acceleration[1] * seconds - (wheels[1] - uy)) * kept
        self._speed = vx, vy
        self._way = (x + vx * seconds) * remembered, (y + vy * seconds) * remembered


def _turned(x: float, y: float, yaw: float) -> tuple[float, float]:
    c, s = math.cos(yaw), math.sin(yaw)
    return c * x - s * y, s * x + c * y
