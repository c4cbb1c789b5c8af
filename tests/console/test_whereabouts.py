"""A robot is shown where it believes to be, and nowhere before it has said so."""

from __future__ import annotations

import pytest

from roboglot.console.views import RobotView
from roboglot.fleet import Fleet
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.geometry import Pose
from roboglot.testing import Forward


@pytest.mark.world("empty", body="robomaster_ep")
async def test_robot_without_localization_is_shown_by_its_odometry(fleet: Fleet, forward: Forward) -> None:
    robot = fleet.robots["a"]
    view = RobotView(robot, fleet.world.hands)
    view.settle()
    assert Localization not in robot
    robot[Driving].move_by(Pose(0.5, 0.0, 0.0))
    await forward(seconds=5)
    assert view.motion[:2] == [pytest.approx(0.5, abs=0.05), pytest.approx(0.0, abs=0.05)]
    assert view.anchor is not None
    there = view.anchor.compose(Pose(0.5))
    assert fleet.world.truth.pose_of("a").distance_to(there) < 0.1
    view.end()


@pytest.mark.world("empty")
async def test_robot_that_was_never_heard_has_no_pose(fleet: Fleet, forward: Forward) -> None:
    robot = fleet.robots["a"]
    link = robot.add(Link, Link("slamware://127.0.0.1:9", robot.clock, robot.events, robot[Health]))
    view = RobotView(robot, fleet.world.hands)
    view.settle()
    assert (view.motion, view.anchor) == ([None] * 6, None)
    link.move_to(LinkState.UP)
    link.heard("pose")
    link.move_to(LinkState.LOST, "the cable")
    assert view.motion[0] is not None
    view.end()
