"""Claim: forty drives to where no way leads, on a map of 100 x 100 m, leave no more memory behind than four.

In lockstep. Each plan needs arrays as large as the map: none may stay with errors, tasks or the history of actions.
"""

from __future__ import annotations

import asyncio
import gc

import numpy as np
from _claim import Claims
from soak import measure

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.errors import Unreachable
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.storage.database import Database

DRIVES, FIRST = 40, 4
SIDE = 2000  # cells
GROWTH_MAX = 5.0  # %
GOAL = Point(60.0, 60.0)
CELL = 0.05  # m


def site(around: OccupancyGrid) -> OccupancyGrid:
    """Return the room that the robot knows, amid free floor with a closed room on it."""
    cells = np.full((SIDE, SIDE), -60, np.int8)
    origin = Point(around.origin.x - 100 * CELL, around.origin.y - 100 * CELL)
    cells[100 : 100 + around.height, 100 : 100 + around.width] = around.log_odds
    row, column = round((GOAL.y - origin.y) / CELL), round((GOAL.x - origin.x) / CELL)
    cells[row - 40 : row + 41, column - 40 : column + 41] = 100
    cells[row - 37 : row + 38, column - 37 : column + 38] = -60
    return OccupancyGrid(cells, CELL, origin)


async def main() -> None:
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig("a")], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    await clock.advance(3.0)
    robot = fleet.robots["a"]
    robot[Mapping].load(site(robot[Mapping].grid), robot[Localization].pose)
    await clock.advance(3.0)
    figures = []
    for number in range(DRIVES):
        action = robot[Navigation].navigate_to([GOAL], NavigationOptions())
        while not action.status.ended:
            await clock.advance(0.1)
        assert isinstance(action.error, Unreachable), action.reason
        gc.collect()
        figures.append(measure())
        if (number + 1) % 4 == 0:
            print(f"{number + 1} drives: {figures[-1]['RSS, MB']:.0f} MB; {action.reason}", flush=True)
    await fleet.close()
    database.close()
    claims = Claims()
    for name in figures[0]:
        growth = 100 * (max(each[name] for each in figures[FIRST:]) / figures[FIRST - 1][name] - 1)
        claims.at_most(f"{name}, growth after {FIRST} drives", growth, GROWTH_MAX, "%")
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
