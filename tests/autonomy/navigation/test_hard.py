"""Goals, docking and following with bad sensors (the preset `hard`): within twice the usual limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.following import Following
from roboglot.model.geometry import Pose, wrap_angle
from tests.autonomy.test_following import WALKER

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

BODY = "universal+hard"
OFF, TURNED = 0.10, math.radians(4.0)  # m, rad: twice navigation's tolerance


@pytest.mark.slow  # a long story; in short: tests/simulation/test_realism.py
@pytest.mark.world("office", body=BODY)
async def test_goals_and_dock_are_met_with_bad_sensors(tour: Tour) -> None:
    for x, y, deg in ((19.0, 9.8, 90.0), (12.0, 6.5, -45.0), (25.5, 10.0, 180.0)):
        action = await tour.go((x, y), deg=deg)
        assert action.status is ActionStatus.SUCCEEDED, action.reason
        assert tour.truth.distance_to(Pose(x, y)) < OFF
        assert abs(wrap_angle(tour.truth.yaw - math.radians(deg))) < TURNED
    action = await tour.end_of(tour.robot[Docking].dock())
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.truth.distance_to(tour.start) < OFF


@pytest.mark.slow  # with good ones: tests/autonomy/test_following.py
@pytest.mark.world(WALKER, body=BODY)
async def test_a_person_is_followed_with_bad_sensors(tour: Tour) -> None:
    action, gaps = tour.robot[Following].follow(distance=1.2), []
    for _ in range(250):
        await tour.clock.advance(0.1)
        gaps.append(tour.truth.distance_to(tour.world.truth.people[0][1]))
    assert action.status is ActionStatus.EXECUTING, action.reason
    assert max(gaps[50:]) < 2 * 2.4
    assert min(gaps) > 0.5 / 2
    assert not tour.bumps
