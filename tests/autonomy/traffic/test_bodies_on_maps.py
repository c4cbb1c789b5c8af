"""Bodies of other robots are no part of a map, or of a wall: those that announce themselves, and those that do not."""

from __future__ import annotations

import numpy as np
import pytest

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.storage.database import Database

DOOR = slice(40, 60)  # rows of the wall in column 50 that the given map shows as floor


def walled(given: bool) -> EvidenceGrid:
    grid = EvidenceGrid()
    grid.evidence = np.full((100, 100), -500, np.int16)
    grid.slots, grid.marks = np.zeros((100, 100), np.int32), np.zeros((100, 100), np.int16)
    grid.evidence[:, 50] = 500
    grid.evidence[DOOR, 50] = -500
    if given:
        grid.given = grid.evidence < 0
    return grid


@pytest.mark.parametrize(("given", "size", "open_"), [(True, 20, True), (False, 20, False), (True, 30, False)])
def test_body_in_a_door_is_no_wall(given: bool, size: int, open_: bool) -> None:
    from roboglot.autonomy.traffic.doubtful_things import without_doubtful

    grid = walled(given)
    grid.evidence[DOOR, 50 : 50 + size] = 300
    shown = without_doubtful(grid)
    assert bool((shown[DOOR, 50:80] < 0).all()) is open_
    assert (shown[:40, 50] > 0).all()
    assert (shown[60:, 50] > 0).all()


def test_given_floor_keeps_its_place_while_map_grows() -> None:
    grid = walled(given=True)
    grid.make_room(-3.0, -2.0, 5.0, 5.0)
    assert grid.given is not None
    assert grid.given.shape == grid.evidence.shape
    assert ((grid.evidence < 0) == grid.given).all()


@pytest.mark.slow
@pytest.mark.parametrize(("body", "painted"), [("universal", False), ("cyberdog2", True)])
async def test_announced_robots_are_not_mapped(body: str, painted: bool) -> None:
    """A dog has no radio: the map has it, as a piece of furniture."""
    clock, database = LockstepClock(), Database(":memory:")
    robots = [RobotConfig("a", body="hermes"), RobotConfig("b", body=body)]
    fleet = build_fleet("empty", robots, clock=clock, seed=1, database=database)
    poses = {"a": Pose(3.0, 5.0), "b": Pose(5.0, 5.0)}
    for name, pose in poses.items():
        fleet.world.stage.place(name, pose)
    await fleet.start(wait=True)
    empty = np.full((200, 200), -100, np.int8)
    empty[0], empty[-1], empty[:, 0], empty[:, -1] = 100, 100, 100, 100
    for name, pose in poses.items():
        fleet.robots[name][Mapping].load(OccupancyGrid(empty, RESOLUTION, Point()), pose)
    await clock.advance(40.0)
    grid = fleet.robots["a"][Mapping].grid
    row, column = (round((v - o) / RESOLUTION) for v, o in ((5.0, grid.origin.y), (5.0, grid.origin.x)))
    around = grid.log_odds[row - 8 : row + 8, column - 8 : column + 8]
    await fleet.close()
    database.close()
    assert bool((around > 0).any()) is painted
