"""Claim: with the preset `hard`, goals are met within 10 cm and 4 degrees (twice the usual), and the dock is found.

Five seeds in the office, which each robot has driven through before: eight places with a heading, then home onto the
dock. What fails has to say why; what succeeds is measured against the truth, from where the map's frame began.
"""

from __future__ import annotations

import asyncio
import math

from _claim import Claims
from slam import LAP

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.storage.database import Database

SEEDS = (1, 2, 3, 4, 5)
BODY = "universal+hard"
OFF_MAX, TURNED_MAX = 0.10, math.radians(4.0)  # m, rad
SECONDS_MAX = 180.0
GOALS = 8


async def ended(action: Action, clock: LockstepClock) -> bool:
    """Return True if it succeeds."""
    end = clock.time() + SECONDS_MAX
    while not action.status.ended and clock.time() < end:
        await clock.advance(0.5)
    return action.status is ActionStatus.SUCCEEDED


async def goals_of(fleet: Fleet, clock: LockstepClock, start: Pose) -> list[tuple[float, float]]:
    """True distance from each goal that was reported as reached (m, rad)."""
    off = list[tuple[float, float]]()
    robot = fleet.robots["a"]
    for number, spot in enumerate(LAP[:GOALS]):
        goal = Pose(*spot, 0.7 * number)
        asked = goal.relative_to(start)
        options = NavigationOptions(yaw=asked.yaw)
        action = robot[Navigation].navigate_to([asked.point], options)
        if await ended(action, clock):
            truth = fleet.world.truth.pose_of("a")
            off.append((truth.distance_to(goal), abs(wrap_angle(truth.yaw - goal.yaw))))
        else:
            print(f"    {spot}: {action.reason or 'too long'}")
    return off


async def run(seed: int) -> tuple[list[tuple[float, float]], bool]:
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet("office", [RobotConfig(body=BODY)], clock=clock, seed=seed, database=database)
    await fleet.start(wait=True)
    start = fleet.world.truth.pose_of("a")
    await clock.advance(1.0)
    robot = fleet.robots["a"]
    for spot in LAP:
        await ended(
            robot[Navigation].navigate_to([Pose(*spot).relative_to(start).point], NavigationOptions(retries=2)), clock
        )
    off = await goals_of(fleet, clock, start)
    action = robot[Docking].dock()
    docked = await ended(action, clock)
    print(
        f"seed {seed}: {len(off)} of {GOALS} met, off {', '.join(f'{100 * away:.1f}' for away, _ in off)} cm, at most "
        f"{math.degrees(max(turned for _, turned in off)):.1f} degrees; dock: {'met' if docked else action.reason}",
        flush=True,
    )
    await fleet.close()
    database.close()
    return off, docked


def main() -> None:
    runs = [asyncio.run(run(seed)) for seed in SEEDS]
    off = [one for found, _ in runs for one in found]
    claims = Claims()
    claims.at_least("goals met", len(off), 0.9 * GOALS * len(SEEDS), "")
    claims.at_most("a goal that was met, worst", 100.0 * max(away for away, _ in off), 100.0 * OFF_MAX, "cm")
    worst = math.degrees(max(turned for _, turned in off))
    claims.at_most("its heading, worst", worst, math.degrees(TURNED_MAX), "degrees")
    claims.at_least("docked", sum(docked for _, docked in runs), len(SEEDS), "")
    claims.finish()


if __name__ == "__main__":
    main()
