"""Scans are matched in turn, each before the next one comes."""

from __future__ import annotations

import asyncio

import numpy as np

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.slam import Slam
from roboglot.autonomy.slam.turns import Turns
from roboglot.datasets.drive_log import RecordedScan
from roboglot.datasets.replay import Replay
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.events import PoseJumped, ScanTaken
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.robot import Description, Robot
from roboglot.model.sensing import LaserScan


def scan(stamp: float) -> ScanTaken:
    ranges = np.ones(4, np.float32)
    return ScanTaken(stamp=stamp, scan=LaserScan(stamp, ranges, 0.0, 1.0, 0.1, 9.0, mount=ORIGIN), odometry=ORIGIN)


async def test_no_scan_that_waits_is_lost() -> None:
    clock, taken = RealClock(), list[float]()
    turns = Turns(clock, lambda event: taken.append(event.stamp))
    turns.put(scan(1.0))
    assert taken == []
    turns.put(scan(2.0))
    turns.put(scan(3.0))
    assert taken == [1.0, 2.0]  # turns are late: pending scans are taken before the next one
    await asyncio.sleep(0)
    assert taken == [1.0, 2.0, 3.0]
    turns.put(scan(4.0))
    turns.close()
    await asyncio.sleep(0)
    assert taken == [1.0, 2.0, 3.0]


async def test_scans_are_taken_at_once_in_lockstep() -> None:
    taken = list[float]()
    Turns(LockstepClock(), lambda event: taken.append(event.stamp)).put(scan(1.0))
    assert taken == [1.0]


async def test_a_scan_before_a_given_pose_is_forgotten() -> None:
    """A robot was put back at its start, and for a moment believed to be where it came from."""
    plate = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.2, height=0.2)
    robot = Robot(id="a", description=plate, clock=RealClock())
    replay = Replay(robot.events)
    belief = Belief(replay.odometry)
    slam = Slam(robot, belief)
    ranges = np.full(360, 2.0, np.float32)
    replay.play(RecordedScan(LaserScan(robot.clock.time(), ranges, 0.0, 0.0175, 0.1, 9.0, mount=ORIGIN), ORIGIN))
    robot.events.publish(PoseJumped(stamp=robot.clock.time(), pose=Pose(1.0, 2.0), given=True))
    await asyncio.sleep(0)
    assert not slam.started
    slam.close()
