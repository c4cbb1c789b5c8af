"""Claim: ten minutes of robot time with everything on are the same, byte for byte, in two processes of one seed.

Four bodies in the office, among people who walk: mapping, navigation, docking, lift, legs, gimbal and blaster, faults,
and all the time all detectors, hearing, H.264 and Opus. Every scan, event, sighting, packet and pose goes into the
digests. One process keeps what robots keep in memory, the other one on disk: the disk's speed must not matter.
A minute of it is a minute of processor time, for each of the two.

    scripts/bench trace [--minutes 10] [--seed 5]
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import hashlib
import math
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

from _claim import Claims

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.media.audio import AudioStream
from roboglot.media.video import VideoStream
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.motions import MOTIONS
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.network import Network
from roboglot.model.errors import Refused, RobotError
from roboglot.model.events import Event, ScanTaken
from roboglot.model.feed import Viewer
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.storage.database import Database

BODIES = {"a": "universal", "h": "hermes", "d": "cyberdog2", "e": "robomaster_ep"}
FAULTS = ("wifi_loss", "lidar_gone", "motor_fault", "lost_localization", "bumper_stuck", "blocked_path", "low_battery")
LOOKS = ("people", "faces", "gestures", "skeletons", "markers", "lines", "robots", "tags")
STEP, COMMANDS = 0.5, 12.0  # s between two samples, and between two commands to a robot


def command(robot: Robot, dice: random.Random) -> None:
    """Something for the robot to do, out of what it can."""
    choices: list[Callable[[], object]] = [
        lambda: robot[Driving].move_by(Pose(dice.uniform(-0.5, 1.0), 0.0, dice.uniform(-2.0, 2.0)))
    ]
    goal = Point(dice.uniform(-1.0, 5.0), dice.uniform(-3.0, 3.0))
    if Navigation in robot:
        choices += [lambda: robot[Navigation].navigate_to([goal], NavigationOptions(tolerance=0.3))] * 3
    if Docking in robot:
        choices += [lambda: robot[Docking].dock()]
    if Legs in robot:
        motion = dice.choice(sorted(MOTIONS))
        choices += [lambda: robot[Legs].perform(motion), lambda: robot[Legs].lie_down()]
    if LiftClient in robot:
        choices += [lambda: robot[LiftClient].call(dice.randrange(3))]
    if Gimbal in robot:
        choices += [lambda: robot[Gimbal].recenter()]
    if Blaster in robot:
        choices += [lambda: robot[Blaster].fire()]
    if Speaker in robot:
        choices += [lambda: robot[Speaker].say("Good morning")]
    try:
        dice.choice(choices)()
    except RobotError:
        robot.events.publish(Event(stamp=robot.clock.time()))  # refusals belong to the trace


def listen(fleet: Fleet, digest: Callable[[bytes], None]) -> None:
    """Every event and scan of every robot."""
    for robot in fleet.robots.values():
        robot.events.listen(Event, lambda event: digest(f"{type(event).__name__} {event.stamp!r};".encode()))
        robot.events.listen(ScanTaken, lambda event: digest(event.scan.ranges.tobytes()))


def open_senses(fleet: Fleet) -> list[Viewer[Any]]:
    """Subscribe to all detectors and to hearing, and to one robot's video and sound."""
    viewers: list[Viewer[Any]] = []
    for robot in fleet.robots.values():
        if Vision in robot:
            viewers += [getattr(robot[Vision], look).subscribe() for look in LOOKS]
        if Hearing in robot:
            viewers += [robot[Hearing].claps(), robot[Hearing].speech()]
    one = fleet.robots["a"]
    return [*viewers, one[VideoStream].subscribe(), one[AudioStream].subscribe()]


def state_of(fleet: Fleet, robot: Robot) -> bytes:
    """Return the robot's place, measurements and beliefs."""
    values: list[object] = [(fleet.world.truth.pose_of(robot.id), robot[Imu].reading, robot[Battery].state)]
    values.append((robot[Network].signal, robot[Network].state))
    if Localization in robot:
        values.append(robot[Localization].pose)
    return "".join(map(repr, values)).encode()


async def scenario(seed: int, minutes: float, file: str) -> None:
    """Prints a line a minute and at the end: the digest of all until then."""
    clock, database = LockstepClock(), Database(file, in_place=True)
    digest, dice = hashlib.sha256(), random.Random(seed)
    robots = [RobotConfig(name, body=body) for name, body in BODIES.items()]
    fleet = build_fleet("office", robots, clock=clock, seed=seed, database=database)
    await fleet.start(wait=True)
    listen(fleet, digest.update)
    viewers = open_senses(fleet)
    steps = round(minutes * 60.0 / STEP)
    for step in range(1, steps + 1):
        await clock.advance(STEP)
        for viewer in viewers:
            for item in viewer.drain():
                digest.update(repr(item).encode())
        for index, robot in enumerate(fleet.robots.values()):
            digest.update(state_of(fleet, robot))
            if (step + 6 * index) % round(COMMANDS / STEP) == 0:
                command(robot, dice)
        if step % round(45.0 / STEP) == 0:
            with contextlib.suppress(Refused):  # a robot stands where a path would be blocked
                fleet.world.faults.inject(dice.choice(FAULTS), dice.choice(("a", "h")), duration=10.0)
        if step % round(60.0 / STEP) == 0 or step == steps:
            for robot in fleet.robots.values():
                digest.update(robot[Mapping].grid.log_odds.tobytes() if Mapping in robot else b"")
            print(step * STEP / 60.0, digest.hexdigest(), flush=True)
    for viewer in viewers:
        viewer.close()
    await fleet.close()
    database.close()


def main() -> None:
    """Two processes at once; their lines are compared."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--seed", type=int, default=5)
    options.add_argument("--child", help=argparse.SUPPRESS)
    asked = options.parse_args()
    if asked.child:
        asyncio.run(scenario(asked.seed, asked.minutes, asked.child))
        return
    words = [sys.executable, __file__, "--seed", str(asked.seed), "--minutes", str(asked.minutes), "--child"]
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        files = ":memory:", f"{folder}/roboglot.db"
        runs = [subprocess.Popen([*words, file], stdout=subprocess.PIPE, text=True) for file in files]
        first, second = (run.communicate()[0].splitlines() for run in runs)
    for one, other in zip(first, second, strict=False):
        print(f"minute {one.split()[0]:5} {'same' if one == other else 'DIFFERENT'} {one.split()[1][:16]}")
    print(f"{asked.minutes:g} min of four robots, twice at once, in {time.monotonic() - begun:.0f} s")
    same = sum(one == other for one, other in zip(first, second, strict=False))
    claims = Claims()
    claims.at_least("digests that are the same", same, math.ceil(asked.minutes), "")
    claims.finish()


if __name__ == "__main__":
    main()
