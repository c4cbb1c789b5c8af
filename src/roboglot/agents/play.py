"""The child process of a rehearsal: reads a ``Copy`` from standard input, plays it, writes a ``Rehearsal``."""

from __future__ import annotations

import asyncio
import math
import sys

import msgspec

from roboglot.agents.rehearsal import ROBOT_SECONDS_MAX, TICK, Copy, Played, Rehearsal, Step, absolute, relative
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.errors import RobotError
from roboglot.model.events import BumperPressed, CliffDetected, Event, ObstacleBraked, PathBlocked, RobotBlocked
from roboglot.model.geometry import ORIGIN, Point, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.storage.database import Database

NAME, SOURCE = "a", "rehearsal"
BOX_HEIGHT = 1.0  # m
HITS_MAX = 20
SETTLE = 1.0  # s for the first scans
HITS: dict[type[Event], str] = {
    BumperPressed: "bumps into something",
    CliffDetected: "reaches an edge",
    ObstacleBraked: "is braked before an obstacle",
    PathBlocked: "finds the way blocked",
    RobotBlocked: "is stuck",
}


async def play(copy: Copy) -> Rehearsal:
    """Build the copy, play every step to its end, tear it down."""
    clock, database = LockstepClock(), Database(":memory:", in_place=True)
    fleet = build_fleet(copy.world, [RobotConfig(NAME, copy.body)], clock=clock, seed=copy.seed, database=database)
    try:
        await fleet.start(wait=True)
        hands, robot = fleet.world.hands, fleet.robots[NAME]
        x, y, yaw, floor = copy.robot
        for bx, by, turn, level, width, depth in copy.boxes:
            hands.add_obstacle(Pose(bx, by, turn), (width, depth, BOX_HEIGHT), level)
        for name, (px, py, facing, _) in copy.people.items():
            hands.person(name).stand()
            hands.person(name).place(px, py, math.degrees(facing))
        hands.place(NAME, Pose(x, y, yaw), floor)
        if Mapping in robot:
            robot[Mapping].clear()
        await clock.advance(SETTLE)
        return await _played(robot, clock, copy)
    finally:
        await fleet.close()
        database.close()


async def _played(robot: Robot, clock: LockstepClock, copy: Copy) -> Rehearsal:
    began, done = clock.time(), list[Played]()
    hits: list[str] = []
    start = robot[Localization].pose if Localization in robot else ORIGIN
    leave = [robot.events.listen(kind, lambda event: _note(event, hits, robot, clock.time() - began)) for kind in HITS]
    for step in copy.steps:
        done.append(await _step(robot, clock, step, copy, start, began))
        if done[-1]["status"] != ActionStatus.SUCCEEDED.name:
            break
    for end in leave:
        end()
    there = robot[Localization].pose.relative_to(start) if Localization in robot else ORIGIN
    end_pose = absolute((there.x, there.y, there.yaw), copy.believed)
    return Rehearsal(steps=done, hits=hits, end=end_pose, seconds=round(clock.time() - began, 2))


async def _step(robot: Robot, clock: LockstepClock, step: Step, copy: Copy, start: Pose, began: float) -> Played:
    words = f"go_to {step.go_to}" if step.go_to else f"drive {step.drive}"
    try:
        action = _started(robot, step, copy, start)
        end = clock.time() + ROBOT_SECONDS_MAX
        while not action.status.ended and clock.time() < end:
            await clock.advance(TICK)
        status, reason = action.status.name, action.reason
        if not action.status.ended:
            status, reason = "TOO_LONG", f"it had not ended after {ROBOT_SECONDS_MAX:g} s"
    except RobotError as error:
        status, reason = "REFUSED", str(error)
    return Played(step=words, status=status, reason=reason, at=round(clock.time() - began, 2))


def _started(robot: Robot, step: Step, copy: Copy, start: Pose) -> Action:
    if step.go_to is not None:
        x, y = relative(step.go_to, copy.believed)
        goal = start.compose(Pose(x, y, 0.0))
        return robot[Navigation].navigate_to([Point(goal.x, goal.y)], NavigationOptions(), source=SOURCE)
    assert step.drive is not None
    x, y, yaw, seconds = step.drive
    return robot[Driving].drive(Twist(x, y, yaw), lifetime=seconds, source=SOURCE)


def _note(event: Event, hits: list[str], robot: Robot, at: float) -> None:
    if len(hits) < HITS_MAX:
        pose = robot[Localization].pose if Localization in robot else ORIGIN
        hits.append(f"after {at:.1f} s, {math.hypot(pose.x, pose.y):.2f} m from here, it {HITS[type(event)]}")


if __name__ == "__main__":
    given = msgspec.json.decode(sys.stdin.buffer.read(), type=Copy)
    sys.stdout.buffer.write(msgspec.json.encode(asyncio.run(play(given))))
