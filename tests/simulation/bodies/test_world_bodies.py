"""Bodies of one's own: what is not described is not there, and the rest works without it."""

import re

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.files import BODIES, load_body
from roboglot.simulation.world.declarations import BadFile
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

UNIVERSAL = (BODIES / "universal.toml").read_text()


def without(*sections):
    text = UNIVERSAL
    for section in sections:
        text = re.sub(rf"\[{section}\]\n([^\[]*)", "", text)
    return text


def everything():
    """Return the names of the universal robot's interfaces."""
    clock = LockstepClock()
    world = World(load_world("empty"), [RobotPlacement("a")], clock=clock)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    return {interface.__name__.lower() for interface in robot.interfaces}


@pytest.mark.parametrize(
    "missing",
    [
        ("legs",),
        ("dock_contact",),
        ("battery", "network"),
        ("odometry",),
        (
            "legs",
            "imu",
            "odometry",
            "lidar",
            "battery",
            "dock_contact",
            "bumper",
            "network",
            "motion_status",
            "reflectors",
            "emergency_braking",
        ),
    ],
)
async def test_a_body_without(tmp_path, missing):
    (tmp_path / "body.toml").write_text(without(*missing))
    clock = LockstepClock()
    placement = RobotPlacement("a", str(tmp_path / "body.toml"), start=Pose(2, 5))
    world = World(load_world("empty"), [placement], clock=clock)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    world.start()
    robot[Base].set_velocity(Twist(0.5))
    await clock.advance(2.0)
    assert 2.9 < world.truth.pose_of("a").x < 3.0
    names = {interface.__name__.lower() for interface in robot.interfaces}
    gone = {name.replace("_", "") for name in missing}
    if "imu" in missing:
        gone.add("imuconverters")
    assert everything() - names == gone
    if Lidar in robot:
        assert robot[Lidar].scan.ranges[180] == pytest.approx(10 - world.truth.pose_of("a").x, abs=0.06)
    world.close()


def test_odometry_needs_a_gyro(tmp_path):
    (tmp_path / "body.toml").write_text(without("imu"))
    with pytest.raises(BadFile, match=r"works with a \[imu\], which is missing"):
        load_body(str(tmp_path / "body.toml"))


def test_the_name_plate():
    world = World(load_world("empty"), [RobotPlacement("a")], clock=LockstepClock(), seed=5)
    plate = world.description_of("a")
    assert (plate.maker, plate.model, plate.serial, plate.radius) == ("roboglot", "universal", "RG-0005-a", 0.25)
