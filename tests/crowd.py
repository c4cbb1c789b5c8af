"""Seeded crowds of mixed bodies: some stand, some navigate, some are driven by hand. Judged by the truth.

Used by tests and benchmarks.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from roboglot.config import RobotConfig, StartConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.errors import RobotError
from roboglot.model.events import BumperPressed, Event, LocalizationLost, RobotDisplaced
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.storage.database import Database

BODIES = ("universal", "hermes", "cyberdog2", "robomaster_ep")
CORRIDOR = str(Path(__file__).parent / "autonomy" / "worlds" / "one_corridor.toml")
SHOVED = 0.05  # m that a standing robot may be displaced
ASTRAY = 0.3  # m of error at which a robot must not be sure of its place
SURE = 0.5  # quality from which a robot counts as sure
LOOK = 0.1  # s between two samples of all robots
RESTS = 0.001  # m between two samples up to which a robot counts as standing
ROOM = (0.6, 9.4)  # m, both ways, of the world "empty"
TOP = 3.5  # m/s at most by hand
APART = 0.9  # m between two robots' centres at the start
GOAL = 0.2  # m from the goal within which a drive has succeeded


@dataclass
class Walker:
    """One robot of the crowd, its command, and the place at which it came to rest."""

    robot: Robot
    role: str
    origin: Pose
    action: Action | None = None
    goal: Pose | None = None
    stood_at: Pose | None = None
    before: Pose = field(default_factory=Pose)  # place at the last sample
    shoved: float = 0.0
    presses: int = 0
    reported_lost: bool = False  # it reported a doubt about its place

    def listen(self) -> None:
        """Count its reports: of contacts, and of doubts about its place."""
        events = self.robot.events
        events.listen(BumperPressed, self.count)
        events.listen(RobotDisplaced, self._note_lost)
        events.listen(LocalizationLost, self._note_lost)

    def _note_lost(self, _: Event) -> None:
        self.reported_lost = True

    def count(self, _: BumperPressed) -> None:
        """Count a contact."""
        self.presses += 1


@dataclass
class Outcome:
    """Outcome of one crowd."""

    seed: int
    shoved: float = 0.0  # m, the largest displacement of a standing robot
    presses: int = 0
    false_successes: list[str] = field(default_factory=list)
    sure_but_astray: list[str] = field(default_factory=list)
    silent: list[str] = field(default_factory=list)  # shoved robots that reported nothing
    arrived: int = 0  # robots that succeeded
    worst: str = ""


async def leave(seed: int, seconds: float) -> Outcome:
    """Have ten robots of all bodies leave one corridor at once, though they block one another."""
    clock, database = LockstepClock(), Database(":memory:")
    starts = [StartConfig(0.8 + 0.7 * n, 2.6 if n % 2 else 3.4) for n in range(10)]
    configs = [RobotConfig(f"r{n}", BODIES[(n + seed) % len(BODIES)], start=at) for n, at in enumerate(starts)]
    fleet = build_fleet(CORRIDOR, configs, clock=clock, seed=seed, database=database)
    await fleet.start(wait=True)
    await clock.advance(1.0)
    walkers = []
    for n, robot in enumerate(fleet.robots.values()):
        pose = fleet.world.truth.pose_of(robot.id)
        belief = robot[Localization].pose if Localization in robot else Pose()
        walker = Walker(robot, "navigates" if Navigation in robot else "driven", pose.compose(belief.inverse()))
        walker.listen()
        _send(walker, Pose(9.2 + 0.9 * (n // 2), 1.5 if n % 2 else 4.5), pose)
        walkers.append(walker)
    outcome = Outcome(seed)
    for _ in range(round(seconds / LOOK)):
        for walker in walkers:
            _look(fleet, walker)
        await clock.advance(LOOK)
    for walker in walkers:
        _judge(fleet, walker, outcome)
    await fleet.close()
    database.close()
    return outcome


def _send(walker: Walker, goal: Pose, here: Pose) -> None:
    """Send a robot out of the corridor: by its map if it has one, else blindly ahead."""
    robot = walker.robot
    try:
        if walker.role == "navigates":
            walker.goal = goal
            seen = goal.relative_to(walker.origin)
            walker.action = robot[Navigation].navigate_to([seen.point], NavigationOptions(retries=0), source="crowd")
        else:
            walker.action = robot[Driving].move_by(Pose(8.5 - here.x), speed=0.5, source="crowd")
    except RobotError:
        walker.action = None


async def crowd(seed: int, seconds: float = 20.0) -> Outcome:
    """Give a crowd commands for ``seconds`` of robot time."""
    dice, clock, database = random.Random(seed), LockstepClock(), Database(":memory:")
    bodies = [dice.choice(BODIES) for _ in range(dice.randint(3, 6))]
    places = zip(bodies, _places(dice, len(bodies)), strict=False)
    configs = [RobotConfig(f"r{n}", body, start=StartConfig(at.x, at.y, at.yaw)) for n, (body, at) in enumerate(places)]
    fleet = build_fleet("empty", configs, clock=clock, seed=seed, database=database)
    await fleet.start(wait=True)
    await clock.advance(1.0)
    walkers = [_walker(fleet, robot, dice) for robot in fleet.robots.values()]
    for walker in walkers:
        walker.listen()
    outcome = Outcome(seed)
    for _ in range(round(seconds / LOOK)):
        for walker in walkers:
            _look(fleet, walker)
            idle = walker.role != "stands" and not walker.robot.actions.running(BASE)
            if idle and dice.random() < 0.1:
                _go(fleet, walker, dice)
        await clock.advance(LOOK)
    for walker in walkers:
        _judge(fleet, walker, outcome)
    await fleet.close()
    database.close()
    return outcome


def _places(dice: random.Random, count: int) -> Iterator[Pose]:
    found: list[Pose] = []
    while len(found) < count:
        pose = Pose(dice.uniform(*ROOM), dice.uniform(*ROOM), dice.uniform(-math.pi, math.pi))
        if all(pose.distance_to(other) > APART for other in found):
            found.append(pose)
            yield pose


def _walker(fleet: Fleet, robot: Robot, dice: random.Random) -> Walker:
    roles = ["stands", "driven"] + (["navigates"] * 2 if Navigation in robot else [])
    pose = fleet.world.truth.pose_of(robot.id)
    belief = robot[Localization].pose if Localization in robot else Pose()
    return Walker(robot, dice.choice(roles), pose.compose(belief.inverse()))


def _go(fleet: Fleet, walker: Walker, dice: random.Random) -> None:
    """Give a robot a new command."""
    robot = walker.robot
    walker.goal = None
    try:
        if walker.role == "navigates":
            walker.goal = Pose(dice.uniform(*ROOM), dice.uniform(*ROOM))
            seen = walker.goal.relative_to(walker.origin)
            walker.action = robot[Navigation].navigate_to([seen.point], NavigationOptions(retries=0), source="crowd")
        elif dice.random() < 0.5:
            top = robot[Base].limits.twist
            way, speed = dice.uniform(-math.pi, math.pi), dice.uniform(0.2, 1.0) * min(TOP, top.x)
            if not robot[Base].limits.holonomic:
                way = dice.choice((0.0, math.pi))
            twist = Twist(speed * math.cos(way), speed * math.sin(way), dice.uniform(-0.5, 0.5))
            walker.action = robot[Driving].drive(twist, lifetime=dice.uniform(1.0, 6.0), source="crowd")
        else:
            offset = Pose(dice.uniform(-2.0, 3.0), 0.0, dice.choice((0.0, dice.uniform(-3.0, 3.0))))
            walker.action = robot[Driving].move_by(offset, speed=TOP, source="crowd")
    except RobotError:
        walker.action = None


def _look(fleet: Fleet, walker: Walker) -> None:
    """Measure how far a standing robot has been displaced."""
    robot, pose = walker.robot, fleet.world.truth.pose_of(walker.robot.id)
    velocity, walker.before, before = robot[Base].velocity, pose, walker.before
    moving = robot.actions.running(BASE) or velocity.speed > 0.005 or abs(velocity.yaw) > 0.01
    if moving:
        walker.stood_at = None
    elif walker.stood_at is None:
        if pose.distance_to(before) < RESTS:  # it has come to rest
            walker.stood_at = pose
    else:
        walker.shoved = max(walker.shoved, pose.distance_to(walker.stood_at))


def _judge(fleet: Fleet, walker: Walker, outcome: Outcome) -> None:
    robot, name = walker.robot, f"{walker.robot.id} ({walker.robot.description.model}, {walker.role})"
    outcome.presses += walker.presses
    if walker.shoved > SHOVED and not walker.reported_lost:
        outcome.silent.append(f"{name}: shoved by {walker.shoved:.2f} m")
    if walker.shoved > outcome.shoved:
        outcome.shoved, outcome.worst = walker.shoved, name
    if Localization not in robot:
        return
    truth, belief = fleet.world.truth.pose_of(robot.id), walker.origin.compose(robot[Localization].pose)
    off, quality = truth.distance_to(belief), robot[Localization].quality
    if off > ASTRAY and quality > SURE:
        outcome.sure_but_astray.append(f"{name}: {off:.2f} m at quality {quality:.2f}")
    done = walker.action is not None and walker.action.status is ActionStatus.SUCCEEDED
    outcome.arrived += done
    if done and walker.goal is not None and (away := truth.distance_to(walker.goal)) > GOAL:
        outcome.false_successes.append(f"{name}: {away:.2f} m from its goal")
