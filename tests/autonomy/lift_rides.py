"""Rides in the office's lift: its place, a quick one, and a comparison of the floors' maps."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import numpy as np
import pytest

from roboglot.autonomy.building.floors import LiftFloors
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid
from tests.autonomy.conftest import Tour


def say_where_the_lift_is(tour: Tour) -> None:
    waiting, inside = (Pose(x, 10.0, math.pi).relative_to(tour.start) for x in (2.7, 1.0))
    tour.robot[Floors].set_lift(waiting, inside)


def agreement(earlier: OccupancyGrid, later: OccupancyGrid) -> float:
    """Return the share of cells known earlier that are shown alike, place by place; a map may grow meanwhile."""
    known = np.argwhere(earlier.log_odds != 0)
    shift = np.array((earlier.origin.y - later.origin.y, earlier.origin.x - later.origin.x)) / later.resolution
    moved = known + np.rint(shift).astype(int)
    within = ((moved >= 0) & (moved < later.log_odds.shape)).all(axis=1)
    before, after = earlier.log_odds[tuple(known[within].T)], later.log_odds[tuple(moved[within].T)]
    return float(np.count_nonzero(np.sign(before) == np.sign(after)) / len(known))


@asynccontextmanager
async def quick_lift(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[LiftFloors]:
    """Yield the floors of a robot that takes any place for the car, needs no way into it, and rides five seconds."""

    async def already_there(*, backwards: bool) -> None:
        assert backwards in (True, False)

    async def five_seconds(floor: int) -> None:
        await tour.clock.sleep(5.0)
        monkeypatch.setattr(type(lift), "state", replace(lift.state, floor=floor, target=None))

    floors, lift = tour.robot[Floors], tour.robot[LiftClient]
    assert isinstance(floors, LiftFloors)
    monkeypatch.setattr(LiftFloors, "_is_aboard", True)
    monkeypatch.setattr(floors, "_through", already_there)
    monkeypatch.setattr(floors, "_comes", five_seconds)
    say_where_the_lift_is(tour)
    yield floors
    monkeypatch.setattr(LiftFloors, "_is_aboard", False)
    await tour.clock.advance(1.0)  # a stay in the car ends
