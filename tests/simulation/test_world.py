"""The world as a whole: obstacles, people, placement, time."""

import asyncio
import logging
import math
import subprocess
import sys
import time

import pytest

from roboglot.model.clock import LEAD_MAX, Clock, LockstepClock, PatientClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Collided, NotFound
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.building.props import OBSTACLES_MAX
from roboglot.simulation.world.timing import BEHIND_MAX
from roboglot.simulation.world.world import TICK, RobotPlacement, World
from roboglot.simulation.world.world_files import load_world


async def test_obstacle_that_appears_is_seen_and_stops_robot(simulate):
    sim = simulate(start=Pose(3, 5))
    sim.world.start()
    box = sim.world.stage.add_obstacle(Pose(6, 5), (0.5, 0.5, 1.0))
    await sim.clock.advance(0.1)
    assert sim.robot[Lidar].scan.ranges[180] == pytest.approx(2.75, abs=0.05)
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(5.0)
    assert sim.pose.x == pytest.approx(5.5, abs=0.01)
    with pytest.raises(Collided):
        sim.robot[Base].set_velocity(Twist(1.0))
    sim.world.stage.remove_obstacle(box)
    await sim.clock.advance(0.1)
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(2.5)
    assert sim.pose.x > 7.0


async def test_obstacles_are_counted(simulate):
    world = simulate().world
    numbers = [world.stage.add_obstacle(Pose(1 + i * 0.5, 9)) for i in range(OBSTACLES_MAX)]
    with pytest.raises(ValueError, match="no more than"):
        world.stage.add_obstacle(Pose(5, 5))
    world.stage.remove_obstacle(numbers[3])
    with pytest.raises(NotFound):
        world.stage.remove_obstacle(numbers[3])
    with pytest.raises(ValueError, match="20 m"):
        world.stage.add_obstacle(Pose(5, 5), (0.5, -1.0, 1.0))
    assert world.stage.add_obstacle(Pose(5, 5)) == numbers[3]


async def test_people_walk_and_the_lidar_sees_them(simulate):
    sim = simulate("office", start=Pose(14.0, 9.2))
    sim.world.start()
    floor, before = sim.world.truth.people[0]
    nearest = []
    for _ in range(20):
        await sim.clock.advance(1.0)
        nearest.append(float(sim.robot[Lidar].scan.ranges[270:].min()))
    assert (floor, sim.world.truth.people[0][0]) == (0, 0)
    assert sim.world.truth.people[0][1].x > before.x + 10
    assert min(nearest) < 0.8 < max(nearest)  # a person came past


async def test_people_wait_for_robots_then_go_around(simulate):
    sim = simulate("office", start=Pose(8.0, 10.2))
    sim.world.start()
    way = []
    for _ in range(200):
        await sim.clock.advance(0.1)
        way.append(sim.world.truth.people[0][1])
    assert sum(7.1 < person.x < 7.3 for person in way) >= 25
    assert min(person.distance_to(sim.pose) for person in way) > 0.5
    assert way[-1].x > 9.0
    assert sim.pose.distance_to(Pose(8.0, 10.2)) < 0.02


async def test_odometry_does_not_notice_being_lifted(simulate):
    sim = simulate(start=Pose(5, 5))
    sim.world.start()
    await sim.clock.advance(1.0)
    sim.world.stage.place("a", Pose(2, 2, 1.0))
    await sim.clock.advance(1.0)
    assert sim.pose.distance_to(Pose(2, 2)) < 0.001
    assert sim.robot[Odometry].reading.pose == Pose()


async def test_no_one_is_put_outside_the_world(simulate):
    sim = simulate(start=Pose(5, 5))
    for pose, floor in ((Pose(-0.1, 5), 0), (Pose(5, 10.1), 0), (Pose(math.nan, 5), 0), (Pose(5, 5), 1)):
        with pytest.raises(ValueError, match="no place"):
            sim.world.stage.place("a", pose, floor)
        with pytest.raises(ValueError, match=r"no place|must be finite"):
            sim.world.faults.inject("lost_localization", "a", x=pose.x, y=pose.y, floor=floor)
    assert sim.pose == Pose(5, 5)


async def test_floors_are_apart(simulate):
    sim = simulate("office", floor=2)
    sim.world.start()
    await sim.clock.advance(1.0)
    assert sim.world.truth.floor_of("a") == 2
    on_top = sim.robot[Lidar].scan.ranges.copy()
    sim.world.stage.place("a", sim.pose, floor=1)
    await sim.clock.advance(0.2)
    assert sim.world.truth.floor_of("a") == 1
    below = sim.robot[Lidar].scan.ranges
    assert abs(on_top[on_top < 5] - below[on_top < 5]).max() > 0.5  # other furniture


async def test_robots_start_apart_and_on_the_floor(simulate):
    names = ("a", *(f"r{i}" for i in range(12)))
    sim = simulate("office", robots=names)
    sim.world.start()
    await sim.clock.advance(1.0)
    poses = [sim.world.truth.pose_of(name) for name in names]
    assert min(p.distance_to(q) for i, p in enumerate(poses) for q in poses[:i]) > 0.6
    for name, pose in zip(names, poses, strict=True):
        ranges = sim.robots[name][Lidar].scan.ranges
        assert ranges.min() > 0.2, (name, pose)


@pytest.mark.parametrize(
    ("placement", "message"),
    [
        (RobotPlacement("a", start=Pose(0.1, 5)), "cannot stand"),
        (RobotPlacement("a", start=Pose(50, 5)), "has no place"),
        (RobotPlacement("a", floor=3), "no floor 3"),
        (RobotPlacement("a", body="unicorn"), "is named 'unicorn', and it is not a .toml file; there are .*universal"),
    ],
)
def test_impossible_placements_are_refused_in_plain_words(placement, message):
    with pytest.raises(ValueError, match=message):
        World(load_world("empty"), [placement], clock=LockstepClock())


def test_unknown_robots_are_refused(simulate):
    world = simulate().world
    with pytest.raises(NotFound, match="'z'"):
        world.truth.pose_of("z")
    with pytest.raises(ValueError, match="two robots have the name a"):
        World(load_world("empty"), [RobotPlacement("a"), RobotPlacement("a")], clock=LockstepClock())


async def test_a_closed_world_stands_still(simulate):
    sim = simulate(start=Pose(5, 5))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(1.0)
    sim.world.close()
    there = sim.pose
    await sim.clock.advance(1.0)
    assert sim.pose == there


async def test_a_world_started_again_beats_once():
    clock = Jumping()
    world = World(load_world("empty"), [RobotPlacement("a", start=Pose(2, 5))], clock=clock)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    world.start()

    def again(_event):
        world.close()
        world.start()

    robot.events.listen(ScanTaken, again)  # in the middle of a tick
    for _ in range(20):
        clock.leap(TICK)
        assert len(clock.waiting) == 1
    world.close()


class Jumping(Clock):
    """A clock whose owner is too slow: time leaps whenever it likes."""

    def __init__(self) -> None:
        self.now = 0.0
        self.waiting: list = []

    def time(self):
        return self.now

    def epoch(self):
        return self.now

    def call_at(self, _when, callback):
        self.waiting.append(callback)
        return asyncio.get_running_loop().call_later(3600, lambda: None)

    def leap(self, seconds):
        self.now += seconds
        waiting, self.waiting = self.waiting, []
        for callback in waiting:
            callback()


async def test_a_slow_machine_skips_time_with_one_warning(caplog):
    clock = Jumping()
    world = World(load_world("empty"), [RobotPlacement("a", start=Pose(2, 5))], clock=clock)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    world.start()
    robot[Base].set_velocity(Twist(1.0))
    with caplog.at_level(logging.WARNING):
        clock.leap(2 * BEHIND_MAX * TICK)
        clock.leap(100.0)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert "real-time factor 0." in caplog.text
    assert world.truth.pose_of("a").x < 2.01  # two ticks, not a hundred seconds
    assert robot[Odometry].reading.stamp == pytest.approx(clock.now)
    clock.leap(3 * TICK)
    assert robot[Odometry].reading.stamp == pytest.approx(clock.now - 2 * TICK)  # other tasks run between ticks
    clock.leap(0)
    clock.leap(0)
    assert robot[Odometry].reading.stamp == pytest.approx(clock.now)
    world.close()


@pytest.mark.parametrize(("clock", "ticks"), [(Jumping, 5), (LockstepClock, 1)])
async def test_robots_scan_in_turns_in_real_time(clock, ticks):
    clock, scans = clock(), []
    world = World(load_world("empty"), [RobotPlacement(name) for name in "abcde"], clock=clock)
    for name in "abcde":
        robot = Robot(name, world.description_of(name), clock)
        world.equip(robot)
        robot.events.listen(ScanTaken, lambda event: scans.append(round(event.stamp / TICK)))
    world.start()
    if isinstance(clock, LockstepClock):
        await clock.advance(9.5 * TICK)
    else:
        for _ in range(9):
            clock.leap(TICK)
    assert len(scans) == 5
    assert len(set(scans)) == ticks
    world.close()


def busy():
    """Keep the loop busy for 20 s of robot time, without simulation."""
    time.sleep(0.001)


async def test_patient_clock_waits_for_slow_world():
    clock = PatientClock(speed=20_000.0)  # no machine simulates half of that
    world = World(load_world("empty"), [RobotPlacement("a", start=Pose(2, 5))], clock=clock)
    world.equip(Robot("a", world.description_of("a"), clock))
    world.start()
    began, simulated = clock.time(), world.simulated
    for _ in range(10):
        await clock.sleep(0.5)
        busy()
        assert clock.time() - began <= world.simulated - simulated + LEAD_MAX + 1e-6
    assert world.simulated - simulated >= 5.0 - LEAD_MAX
    world.close()
    await clock.sleep(1000.0)  # no need to simulate it


def test_mujoco_is_loaded_with_the_first_world_only():
    code = "import sys, roboglot.simulation.world.world; sys.exit('mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=100).returncode == 0


FIRST_WORLD = """
import sys
from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world
World(load_world("empty"), [RobotPlacement("a")], clock=LockstepClock()).description_of("a")
searched = "importlib.metadata" in sys.modules
import importlib.metadata
sys.exit(searched)
"""


def test_the_first_world_does_not_search_installed_packages():
    """It takes 20 ms of each start."""
    assert subprocess.run([sys.executable, "-c", FIRST_WORLD], check=False, timeout=100).returncode == 0


async def test_nothing_that_can_move_ever_falls_asleep(simulate):
    sim = simulate("obstacle_course")
    model, data = sim.world._physics._model, sim.world._physics._data
    sim.world.start()
    await sim.clock.advance(5.0)  # longer than the physics waits before a thing sleeps
    assert model.ntree > 1
    assert (data.tree_asleep < 0).all()
    can = next(iter(sim.world._physics.things))
    can.put((2.0, 2.0, 0.4))
    await sim.clock.advance(1.0)
    assert can.position[2] == pytest.approx(0.0, abs=0.01)
