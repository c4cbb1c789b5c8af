"""Robots that are computed together sense, to the last bit, what each would alone."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.motion_status import MotionStatus
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Pose, Twist, Vector3
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import parts
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

BODIES = {"a": "universal", "d": "cyberdog2", "h": "hermes"}
SECONDS = 6  # in which all that is below happens, and noise is drawn several times


def commands(dice: random.Random) -> Iterator[Twist | WheelSpeeds]:
    """Yield commands for bases: curves, sideways ways, single wheels, halts."""
    while True:
        sideways = dice.choice((0.0, 0.0, dice.uniform(-0.3, 0.3)))
        yield Twist(dice.uniform(-0.5, 0.8), sideways, dice.uniform(-1.5, 1.5))
        yield dice.choice((Twist(), WheelSpeeds(*(dice.uniform(-8.0, 8.0) for _ in range(4)))))


async def sensed(*, together: bool) -> list[str]:
    """Return all that robots sense who drive, are pushed, lifted, laid down, turned over, and lose a motor."""
    clock, dice = LockstepClock(), random.Random(3)
    placements = [RobotPlacement(name, body) for name, body in BODIES.items()]
    world = World(load_world("office"), placements, clock=clock, seed=4)
    robots = [Robot(name, world.description_of(name), clock) for name in BODIES]
    for robot in robots:
        world.equip(robot)
    if together:
        world._physics.tables.load_kernels()
    happenings = {
        1: lambda: world.stage.push("a", Vector3(30.0, 10.0, 5.0)),
        2: lambda: world.stage.lift("h", 0.2),
        3: lambda: world.stage.let_go("h"),
        4: lambda: world.faults.inject("motor_fault", "h", duration=1.5),
        5: lambda: (robots[1][Legs].lie_down(), robots[0][Gimbal].set_mode(FollowMode.GIMBAL_LEAD)),
        6: lambda: world.stage.place("a", Pose(22.0, 10.0, 2.0)),
        0: lambda: world.stage.add_obstacle(Pose(21.5, 10.5)),
    }
    world.start()
    wanted, lines = commands(dice), list[str]()
    for step in range(10 * SECONDS):
        await clock.advance(0.1)
        for robot in robots:
            if dice.random() < 0.2:
                _command(robot, next(wanted))
            values = robot[Imu].reading, robot[Odometry].reading, robot[Base].velocity
            if Gimbal in robot:
                lines.append(f"{robot[Gimbal].angles} {robot[Gimbal].attitude}")
            flags = robot[MotionStatus].flags if MotionStatus in robot else None
            docked = robot[DockContact].docked if DockContact in robot else None
            lines.append(f"{step} {robot.id} {values} {flags} {docked} {world.truth.pose_of(robot.id)}")
        if step % 10 == 5 and (happening := happenings.get(step // 10)):
            happening()
    world.close()
    return lines


def _command(robot: Robot, command: Twist | WheelSpeeds) -> None:
    try:
        if isinstance(command, Twist):
            robot[Base].set_velocity(command)
        else:
            robot[Base].set_wheel_speeds(command)
    except RobotError:
        pass  # locked, or a bumper is pressed


@pytest.mark.parametrize("name", [part.name for part in parts() if part.sense_all is not None])
def test_part_sensed_together_needs_none_sensed_later(name: str) -> None:
    by_name = {part.name: part for part in parts()}
    before = [by_name[other] for other in by_name[name].after]
    assert all(part.sense is None or part.sense_all is not None for part in before)


async def test_robots_computed_together_sense_what_each_would_alone() -> None:
    assert await sensed(together=True) == await sensed(together=False)


def test_a_robot_may_join_within_a_tick() -> None:
    """Other tasks come between the steps of a tick, and one of them may equip a robot."""
    clock = LockstepClock()
    world = World(load_world("office"), [RobotPlacement(name, body) for name, body in BODIES.items()], clock=clock)
    robots = [Robot(name, world.description_of(name), clock) for name in BODIES]
    world.equip(robots[0])
    world._physics.tables.load_kernels()
    for joining in robots[1:]:
        steps = world._tick()
        next(steps)
        world.equip(joining)
        for _ in steps:
            pass
    for _ in world._tick():
        pass
    assert all(robot[Imu].reading.stamp > 0.0 for robot in robots)
    world.close()
