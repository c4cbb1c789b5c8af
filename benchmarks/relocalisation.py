"""Claim: put down at 200 random places of the mapped office, the robot finds itself in >= 95 %, in <= 50 ms median."""

from __future__ import annotations

import asyncio
import math
import statistics
import time

import numpy as np
from _claim import Claims

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.kernels.distance import distances
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.storage.database import Database

PLACES, SHARE_MIN, MILLISECONDS_MAX = 200, 0.95, 50.0
GOOD, GOOD_YAW = 0.1, math.radians(3.0)  # m, rad from the truth
TOUR = [(25.0, 10.0), (26.0, 7.5), (19.0, 10.0), (19.0, 7.0), (12.0, 9.5), (11.4, 4.0), (5.0, 9.5), (5.0, 5.0),
        (3.0, 10.0), (4.0, 13.0), (11.0, 12.5), (11.6, 15.0), (20.5, 12.5), (27.0, 12.5), (22.5, 10.0)]  # fmt: skip


async def places(robot: Robot, draw: np.random.Generator) -> list[Pose]:
    """Random poses on known floor where the hull has room."""
    grid = robot[Mapping].grid
    room = distances((grid.log_odds >= 0).astype(np.uint8), 20.0) * grid.resolution
    rows, columns = np.nonzero(room > robot.description.radius + 0.1)
    chosen = draw.integers(0, len(rows), PLACES)
    yaws = draw.uniform(-math.pi, math.pi, PLACES)
    at = np.stack([columns[chosen], rows[chosen]], axis=1) * grid.resolution + (grid.origin.x, grid.origin.y)
    return [Pose(*xy, yaw) for xy, yaw in zip(at.tolist(), yaws.tolist(), strict=True)]


async def main() -> None:
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet("office", [RobotConfig()], clock=clock, seed=3, database=database)
    await fleet.start(wait=True)
    robot, world = fleet.robots["a"], fleet.world
    start = world.truth.pose_of("a")
    await clock.advance(1.0)
    for spot in TOUR:
        goal = Pose(*spot).relative_to(start).point
        action = robot[Navigation].navigate_to([goal], NavigationOptions(tolerance=0.3))
        while not action.status.ended:
            await clock.advance(0.5)
    robot[Mapping].enable(False)
    right, seconds = 0, []
    for pose in await places(robot, np.random.default_rng(1)):
        world.hands.place("a", start.compose(pose))
        await clock.advance(0.3)
        action = robot[Localization].relocalize()
        began = time.thread_time()
        await clock.advance(0.0)
        seconds.append(time.thread_time() - began)
        while not action.status.ended:
            await clock.advance(0.5)
        truth, found = world.truth.pose_of("a"), start.compose(robot[Localization].pose)
        good = found.distance_to(truth) < GOOD and abs(wrap_angle(found.yaw - truth.yaw)) < GOOD_YAW
        right += good
        if not good:
            print(f"  wrong at ({truth.x:.2f}, {truth.y:.2f}): {action.status.name}, ({found.x:.2f}, {found.y:.2f})")
    median, worst = statistics.median(seconds) * 1000, max(seconds) * 1000
    claims = Claims()
    claims.at_least("right", 100.0 * right / PLACES, 100.0 * SHARE_MIN, "%")
    claims.at_most(f"median; worst {worst:.0f} ms", median, MILLISECONDS_MAX, "ms")
    await fleet.close()
    database.close()
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
