"""An overloaded machine makes robots slower, and nothing that they say false."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import pytest

from roboglot.config import Config, RobotConfig
from roboglot.fleet import build_fleet, clock_of
from roboglot.model.action import ActionStatus
from roboglot.model.clock import LockstepClock, PatientClock, RealClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.geometry import Pose
from roboglot.storage.database import Database
from tests.slow_machine import SlowMachine

SPEED = 6.0
GOAL = Pose(6.0, 6.5)  # m, world: through the office's door into the corridor


@dataclass
class Drive:
    """Result of a drive: its status, robot and real seconds, distance of the belief from the truth in m."""

    status: ActionStatus
    seconds: float
    real: float
    error: float


async def drive(machine: SlowMachine) -> Drive:
    clock = clock_of(Config(speed=SPEED))
    assert isinstance(clock, RealClock)
    clock.pause()
    database = Database(":memory:", in_place=True)
    fleet = build_fleet("office", (RobotConfig("a"),), clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    machine.begin()
    clock.resume()
    robot, start = fleet.robots["a"], fleet.world.truth.pose_of("a")
    await clock.sleep(1.0)
    began, real = clock.time(), machine.time()
    goals = [GOAL.relative_to(start).point]
    action = robot[Navigation].navigate_to(goals, NavigationOptions(), source="test")
    while not action.status.ended:
        await clock.sleep(0.1)
    off = start.compose(robot[Localization].pose).distance_to(fleet.world.truth.pose_of("a"))
    done = Drive(action.status, clock.time() - began, machine.time() - real, off)
    await fleet.close()
    database.close()
    return done


@pytest.mark.parametrize(
    ("tick", "plan"),
    [pytest.param(0.0, 0.0, marks=pytest.mark.slow), (0.02, 0.5), pytest.param(0.005, 8.0, marks=pytest.mark.slow)],
    ids=["fast", "slow world", "slow plans"],
)
def test_drive_takes_its_robot_time_on_any_machine(
    tick: float, plan: float, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    machine = SlowMachine(monkeypatch, tick=tick, plan=plan)
    with caplog.at_level(logging.WARNING):
        done = machine.run(lambda: drive(machine))
    assert done.status is ActionStatus.SUCCEEDED
    assert 20.0 < done.seconds < 40.0  # people are about; with time that is skipped, 87 s or never
    assert done.error < 0.03
    slower = done.real > 1.5 * done.seconds / SPEED
    assert slower == (tick > 0)
    assert ("robot time fell behind" in caplog.text) == slower


def test_time_waits_only_without_real_robots() -> None:
    assert type(clock_of(Config())) is PatientClock
    assert (
        type(clock_of(Config(robots=(RobotConfig(body="hermes"), RobotConfig("b", "slamware://10.0.0.7")))))
        is RealClock
    )
    assert type(clock_of(Config(lockstep=True))) is LockstepClock
