"""Ten mixed robots that share a building: their goals, the time they take, and contacts of their hulls.

Judged by the truth; the robots have the building's map, their lidars, and radios, if their bodies have one. Used by
tests and benchmarks.
"""

from __future__ import annotations

import math
import random
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.config import RobotConfig, StartConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.simulation.world.placing import Places
from roboglot.simulation.world.world_files import load_world
from roboglot.storage.database import Database

BODIES = ("universal", "hermes", "cyberdog2")  # bodies that navigate; a hermes cannot go sideways
WORLDS = ("office", str(Path(__file__).parent / "autonomy" / "worlds" / "meeting.toml"))
ROBOTS = 10
GOALS = 2  # goals of each robot, one after the other
SECONDS_MAX = 180.0  # s of robot time
LOOK = 0.05  # s between two samples of all robots
TOUCHES = 0.002  # m between two hulls that counts as a touch
START_ROOM, GOAL_ROOM = 0.6, 1.1  # m around a place: a robot passes beside one that stands at its goal
STAYS = 0.5  # m: a robot that stays within has not moved
MISSES = 0.25  # m between a robot and the goal of a drive that succeeded, in the world's truth
WIDEST = 0.27  # m: the largest radius of these bodies
APART = 1.6  # m between two goals, and between two starts
STANDING, WALKING = (Pose(4.6, 3.4),), ("person 0 0", "person 0 1")  # of the office's people
SURVEYED = 1.5  # m between two places of the survey


@dataclass(frozen=True)
class Scenario:
    """Starts and goals of robots that meet, world frame."""

    seed: int
    world: str
    bodies: tuple[str, ...]
    starts: tuple[Pose, ...]
    goals: tuple[tuple[Pose, ...], ...]


@dataclass(frozen=True)
class Touch:
    """Contact of two hulls: its time (s), the robots' names, and an account of their poses and speeds."""

    time: float
    names: tuple[str, str]
    account: str


@dataclass
class Drive:
    """Progress of one robot to its goals."""

    name: str
    goals: tuple[Pose, ...]
    action: Action | None = None
    reached: int = 0
    seconds: float = math.inf  # until it reached its last goal
    failure: str = ""
    stood: float = 0.0  # s: its longest stay at one place
    false_successes: list[str] = field(default_factory=list)
    _place: Pose = field(default_factory=lambda: Pose(math.inf))
    _since: float = 0.0

    def watch(self, pose: Pose, now: float) -> None:
        """Measure how long the robot has stayed at one place."""
        if pose.distance_to(self._place) > STAYS:
            self._place, self._since = pose, now
        self.stood = max(self.stood, now - self._since)

    def arrive(self, pose: Pose) -> None:
        """Count the next goal as reached; ``pose``: where the robot is in the world."""
        if (beside := pose.distance_to(self.goals[self.reached])) > MISSES:
            self.false_successes.append(f"{self.name} succeeded {beside:.2f} m beside goal {self.reached}")
        self.reached += 1


@dataclass
class Outcome:
    """Outcome of one scenario."""

    seed: int
    touches: list[Touch] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)  # robots that reached all their goals
    failures: list[str] = field(default_factory=list)
    false_successes: list[str] = field(default_factory=list)  # drives that succeeded beside their goals
    stood: dict[str, float] = field(default_factory=dict)  # the longest stay at one place before the last goal, s


def scenario(seed: int, robots: int = ROBOTS, world: str = "") -> Scenario:
    """Return the scenario of a seed."""
    dice, world = random.Random(seed), world or WORLDS[seed % len(WORLDS)]
    bodies = [BODIES[n % len(BODIES)] for n in range(robots)]
    dice.shuffle(bodies)
    starts = _places(dice, world, robots, START_ROOM)
    goals = _places(dice, world, robots * GOALS, GOAL_ROOM)
    return Scenario(seed, world, tuple(bodies), tuple(starts), tuple(zip(*[iter(goals)] * GOALS, strict=True)))


def _places(dice: random.Random, world: str, count: int, room: float) -> list[Pose]:
    description = load_world(world)
    free, (width, depth) = Places(description), description.floors[0].size
    found: list[Pose] = []
    while len(found) < count:
        pose = Pose(dice.uniform(0.0, width), dice.uniform(0.0, depth), dice.uniform(-math.pi, math.pi))
        in_lift = world == "office" and pose.x < 2.5 and 8.5 < pose.y < 11.5
        apart = all(pose.distance_to(other) > APART for other in (*found, *(STANDING if world == "office" else ())))
        if apart and not in_lift and free.free(pose, 0, room) and not (room == START_ROOM and _in_person(free, pose)):
            found.append(pose)
    return found


def _in_person(free: Places, pose: Pose) -> bool:
    """Return whether a robot cannot start there because of a person that leaves the building afterwards."""
    return bool(free.in_the_way(pose, 0, WIDEST))


@asynccontextmanager
async def opened(world: str, robots: Sequence[RobotConfig], seed: int) -> AsyncIterator[tuple[Fleet, LockstepClock]]:
    """Yield the robots, in the world without its walking people, and their clock."""
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet(world, robots, clock=clock, seed=seed, database=database)
    if world == "office":
        for name in WALKING:
            fleet.world.stage.remove_person(name)
    await fleet.start(wait=True)
    await clock.advance(0.5)
    try:
        yield fleet, clock
    finally:
        await fleet.close()
        database.close()


async def survey(world: str) -> OccupancyGrid:
    """Return a careful survey's map of a building's lowest floor, in the world's frame."""
    from roboglot.autonomy.slam.painting import paint  # needs the kernels

    async with opened(world, [RobotConfig("surveyor")], 1) as (fleet, clock):
        free, (width, depth) = Places(load_world(world)), load_world(world).floors[0].size
        fleet.robots["surveyor"][Mapping].enable(False)
        fleet.robots["surveyor"][Localization].enable(False)
        grid, reader, lidar = EvidenceGrid(), ScanReader(), fleet.robots["surveyor"][Lidar]
        for row in range(int(depth / SURVEYED)):
            for column in range(int(width / SURVEYED)):
                pose = Pose((column + 0.5) * SURVEYED, (row + 0.5) * SURVEYED, 0.3 * (row + column))
                if free.free(pose, 0, 0.3):
                    fleet.world.stage.place("surveyor", pose)
                    await clock.advance(0.25)
                    scan = lidar.scan
                    assert scan is not None
                    for _ in range(3):
                        paint(grid, reader.read(scan), fleet.world.truth.pose_of("surveyor"), fill=True)
        return grid.occupancy()


async def meet(scene: Scenario, grid: OccupancyGrid | None, alone: int | None = None) -> Outcome:
    """Play a scenario, with the building's map or each robot's own. ``alone``: the number of the only robot."""
    numbers = range(len(scene.bodies)) if alone is None else [alone]
    configs = [RobotConfig(f"r{n}", scene.bodies[n], start=StartConfig(*_numbers(scene.starts[n]))) for n in numbers]
    outcome = Outcome(scene.seed)
    async with opened(scene.world, configs, scene.seed) as (fleet, clock):
        drives = [Drive(config.name, scene.goals[n]) for config, n in zip(configs, numbers, strict=True)]
        frames = {drive.name: _give_map(fleet, drive.name, grid) for drive in drives}
        await clock.advance(1.0)
        begun, touching = clock.time(), frozenset[tuple[str, str]]()
        while clock.time() - begun < SECONDS_MAX and sum(_drive_on(fleet, drive, frames, begun) for drive in drives):
            await clock.advance(LOOK)
            now = frozenset(_touching(fleet))
            outcome.touches += [Touch(clock.time() - begun, pair, _account(fleet, pair)) for pair in now - touching]
            touching = now
    for drive in drives:
        outcome.stood[drive.name] = drive.stood
        outcome.false_successes += drive.false_successes
        if drive.reached == len(drive.goals):
            outcome.seconds[drive.name] = drive.seconds
        else:
            outcome.failures.append(f"{drive.name}: {drive.failure or 'too long'} at goal {drive.reached}")
    return outcome


def _numbers(pose: Pose) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw


def _give_map(fleet: Fleet, name: str, grid: OccupancyGrid | None) -> Pose:
    """Give a robot the building's map, if there is one; return its map's origin in the world."""
    pose, robot = fleet.world.truth.pose_of(name), fleet.robots[name]
    if grid is None:
        return pose.compose(robot[Localization].pose.inverse())
    robot[Mapping].load(grid, pose)
    return Pose()


def _drive_on(fleet: Fleet, drive: Drive, frames: dict[str, Pose], begun: float) -> bool:
    """Send a robot to its next goal once it is at one; return False if it is at the last one or has given up."""
    robot = fleet.robots[drive.name]
    if drive.action is not None:
        if not drive.action.status.ended:
            drive.watch(fleet.world.truth.pose_of(drive.name), robot.clock.time())
            return True
        if drive.action.status is not ActionStatus.SUCCEEDED:
            drive.failure = drive.action.reason
            return False
        if drive.reached < len(drive.goals):
            drive.arrive(fleet.world.truth.pose_of(drive.name))
        if drive.reached == len(drive.goals):
            drive.seconds = min(drive.seconds, robot.clock.time() - begun)
    if drive.reached == len(drive.goals):
        return False
    goal = drive.goals[drive.reached].relative_to(frames[drive.name]).point
    drive.action = robot[Navigation].navigate_to([goal], NavigationOptions(retries=1), source="meeting")
    return True


def _touching(fleet: Fleet) -> list[tuple[str, str]]:
    truth = fleet.world.truth
    discs = [(name, truth.pose_of(name), robot.description.radius) for name, robot in fleet.robots.items()]
    return [
        (a, b) for (a, pose, r), (b, other, s) in combinations(discs, 2) if pose.distance_to(other) < r + s + TOUCHES
    ]


def _account(fleet: Fleet, pair: tuple[str, str]) -> str:
    """Return the places of both, and their speeds (base_link)."""
    lines = []
    for name in pair:
        robot, pose = fleet.robots[name], fleet.world.truth.pose_of(name)
        speed = robot[Base].velocity
        lines.append(
            f"{name} {robot.description.model} ({pose.x:.2f}, {pose.y:.2f}, {math.degrees(pose.yaw):.0f}°)"
            f" at {speed.x:.2f} {speed.y:.2f} m/s {speed.yaw:.1f} rad/s"
        )
    return " | ".join(lines)
