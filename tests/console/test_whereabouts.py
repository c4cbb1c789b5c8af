"""A robot is shown where it believes to be; nothing is made up of one that was never heard."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from roboglot.console.drawings import whereabouts
from roboglot.console.studio.trial import map_origin
from roboglot.console.views import RobotView
from roboglot.fleet import Fleet
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Unconnected
from roboglot.model.geometry import Pose
from roboglot.programs.rehearsing import Scene
from roboglot.protocols.robomaster import readings
from roboglot.protocols.vda5050.vocabulary import is_driving, position, velocity
from roboglot.recording.entries import Entry
from roboglot.recording.sampler import Sampler
from roboglot.testing import Forward
from roboglot.wire.vda5050.versions import V3


@pytest.mark.world("empty", body="robomaster_ep")
async def test_robot_without_localization_is_shown_by_its_odometry(fleet: Fleet, forward: Forward) -> None:
    robot = fleet.robots["a"]
    view = RobotView(robot, fleet.world.stage)
    view.settle()
    assert Localization not in robot
    robot[Driving].move_by(Pose(0.5, 0.0, 0.0))
    await forward(seconds=5)
    assert view.motion[:2] == [pytest.approx(0.5, abs=0.05), pytest.approx(0.0, abs=0.05)]
    assert view.anchor is not None
    there = view.anchor.compose(Pose(0.5))
    assert fleet.world.truth.pose_of("a").distance_to(there) < 0.1
    view.end()
    scene = Scene(world="empty", start=fleet.world.truth.pose_of("a"))
    began = map_origin(robot, scene).compose(scene.start or Pose())
    assert began.distance_to(whereabouts(robot) or Pose()) < 0.05  # what is simulated is drawn in the same map


@pytest.mark.world("empty")
async def test_nothing_is_made_up_of_an_unheard_robot(fleet: Fleet, forward: Forward) -> None:
    robot = fleet.robots["a"]
    link = robot.add(Link, Link("slamware://127.0.0.1:9", robot.clock, robot.events, robot[Health]))
    view, sent = RobotView(robot, fleet.world.stage), list[Entry]()
    view.settle()
    sampler = Sampler(robot, sent.append)
    sampler.beat(0)
    assert (view.motion, view.anchor) == ([None] * 6, None)
    assert (told(view, "battery"), told(view, "place", "quality"), told(view, "safety", "docked")) == (None, None, None)
    assert not {"battery", "pose", "transforms"} & {entry.kind for entry in sent}
    assert position(robot, V3, "map") == velocity(robot) == {}

    link.move_to(LinkState.UP)
    link.note_update("pose")
    sampler.beat(0)
    assert {"battery", "pose", "transforms"} <= {entry.kind for entry in sent}
    assert None not in view.motion
    assert velocity(robot)
    link.move_to(LinkState.LOST, "the cable")
    sent.clear()
    sampler.beat(0)
    assert view.motion[0] is not None
    assert view.motion[3:] == [None] * 3
    assert told(view, "control", "link") == "lost: the cable"
    assert not {"battery", "pose", "transforms"} & {entry.kind for entry in sent}, "no old value with a new time"
    assert (velocity(robot), is_driving(robot)) == ({}, False)
    assert told(view, "battery", "charge")
    assert told(view, "safety", "docked") is True
    assert position(robot, V3, "map")
    with pytest.raises(Unconnected):
        readings.speed(cast("readings.ReadingSource", SimpleNamespace(robot=robot)))
    sampler.close()
    view.end()


def told(view: RobotView, *path: str) -> object:
    """Return a value of the state that pages get."""
    value: object = view.state()
    for key in path:
        assert isinstance(value, dict)
        value = value[key]
    return value
