"""Control of a robot: its holder, exclusive control, and what everyone else learns."""

import asyncio

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.client_context import acting_for
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.components.system.lease import (
    OUTSIDE,
    PERSON,
    TAKEN,
    Lease,
)
from roboglot.model.components.system.link import OTHERS, Link, LinkState
from roboglot.model.errors import Busy, InvalidGoal, Refused, Unconnected
from roboglot.model.events import ControlChanged
from roboglot.model.geometry import STILL, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.testing import Forward
from tests.narrowing import known

pytestmark = pytest.mark.world("empty")
SCRIPT, DASHBOARD = "robomaster 10.0.0.5:4242", "slamware 10.0.0.7"


def faults(robot: Robot) -> dict[str, FaultLevel]:
    return {fault.name: fault.level for fault in robot[Health].faults}


async def test_newest_command_has_the_robot_visibly(robot: Robot, forward: Forward) -> None:
    lease = robot[Lease]
    assert lease.holder is None
    with robot.events.subscribe(ControlChanged) as reported:
        with acting_for(SCRIPT):
            first = robot[Driving].drive(Twist(x=0.2), source="one")
        await forward(seconds=0.5)
        assert lease.holder
        assert (lease.holder.who, lease.holder.doing) == (SCRIPT, "drive")
        with acting_for(DASHBOARD):
            second = robot[Driving].move_by(Pose(x=0.1), source="two")
        await forward(seconds=4)
        assert first.status is ActionStatus.CANCELED
        assert second.status is ActionStatus.SUCCEEDED
        assert lease.holder is None
        assert lease.last.who == DASHBOARD
        assert [event.holder for event in reported.drain()] == [SCRIPT, DASHBOARD]


async def test_two_clients_of_one_door_are_distinguished(robot: Robot, forward: Forward) -> None:
    with acting_for(DASHBOARD):
        one = robot[Driving].drive(Twist(x=0.2), source="slamware")
        assert robot[Driving].drive(Twist(x=0.1), source="slamware") is one
    await forward(seconds=0.1)
    with acting_for("slamware 10.0.0.8"):
        other = robot[Driving].drive(Twist(x=0.2), source="slamware")
    await forward(seconds=1)
    assert one.status is ActionStatus.CANCELED
    assert robot[Lease].holder
    assert known(robot[Lease].holder).who == "slamware 10.0.0.8"
    other.cancel()
    await forward(seconds=1)


async def test_exclusive_control_lasts_until_it_is_released(robot: Robot, forward: Forward) -> None:
    lease = robot[Lease]
    with acting_for(SCRIPT):
        driving = robot[Driving].drive(Twist(x=0.2), source="one")
    await forward(seconds=0.5)
    taking = asyncio.ensure_future(lease.take())
    await forward(seconds=1)
    await taking  # and the robot stands
    assert driving.status is ActionStatus.CANCELED
    assert driving.reason == "a person took control"
    assert lease.taken_by == PERSON
    assert faults(robot) == {TAKEN: FaultLevel.WARNING}
    for who in (SCRIPT, DASHBOARD, ""):
        with acting_for(who):
            with pytest.raises(Busy, match="control is taken by a person"):
                robot[Driving].drive(Twist(x=0.2), source="one")
            with pytest.raises(Busy, match="control is taken by a person"):
                robot[Gimbal].set_speed(0.1, 0.1, source="one")
    robot[Driving].drive(STILL, lifetime=0.1, source="one")  # stopping is always allowed
    await lease.take("robomaster 10.0.0.5")  # handed over
    with acting_for(DASHBOARD), pytest.raises(Busy, match=r"taken by robomaster 10\.0\.0\.5"):
        robot[Driving].move_by(Pose(x=0.1), source="two")
    with acting_for(SCRIPT):
        moving = robot[Driving].move_by(Pose(x=0.1), source="one")
    await lease.release()
    assert faults(robot) == {}
    with acting_for(DASHBOARD):
        robot[Driving].move_by(Pose(x=0.1), source="two")
    await forward(seconds=4)
    assert moving.status is ActionStatus.CANCELED
    assert lease.last.who == DASHBOARD


@pytest.mark.parametrize(
    ("taken", "who", "may"),
    [
        ("robomaster", SCRIPT, True),
        ("robomaster 10.0.0.5", SCRIPT, True),
        (SCRIPT, SCRIPT, True),
        ("robomaster 10.0.0", SCRIPT, False),
        ("robomaster 10.0.0.5:42", SCRIPT, False),
        ("slamware", SCRIPT, False),
        (PERSON, SCRIPT, False),
        (PERSON, "", False),
    ],
)
async def test_client_is_named_by_door_host_or_connection(robot: Robot, taken: str, who: str, may: bool) -> None:
    await robot[Lease].take(taken)
    assert robot[Lease].may_move(who) is may


@pytest.mark.parametrize("name", ["", "  ", "x" * 81, "two\nlines"])
async def test_a_name_is_a_line(robot: Robot, name: str) -> None:
    with pytest.raises(InvalidGoal):
        await robot[Lease].take(name)
    assert robot[Lease].taken_by == ""


async def test_sounds_need_no_control(robot: Robot) -> None:
    await robot[Lease].take()
    with acting_for(SCRIPT):
        robot[Speaker].say("hello", source="one")


async def test_robot_moved_by_someone_else_is_left_alone(robot: Robot, forward: Forward) -> None:
    link = robot.add(Link, Link("test://", robot.clock, robot.events, robot[Health]))
    link.move_to(LinkState.UP)
    lease, stopped = robot[Lease], list[bool]()
    link.held_by(OTHERS)
    assert lease.holder
    assert lease.holder.who == OTHERS
    assert faults(robot) == {OUTSIDE: FaultLevel.WARNING}
    for goal in (Twist(x=0.2), STILL):  # stopping another's action would be only a claim
        with acting_for(SCRIPT), pytest.raises(Busy, match="another client moves the robot"):
            robot[Driving].drive(goal, source="one")
    with pytest.raises(Refused, match="cannot cancel"):
        await lease.take("robomaster")
    assert lease.holder.who == OTHERS

    async def stop() -> None:
        stopped.append(True)

    link.stop_others_by(stop)
    await lease.take("robomaster")
    assert stopped == [True]
    assert lease.holder is None
    with acting_for(SCRIPT):
        robot[Driving].drive(Twist(x=0.2), lifetime=0.1, source="one")
    await forward(seconds=1)
    link.held_by(OTHERS)  # he starts over: the lease does not fight that
    with acting_for(SCRIPT), pytest.raises(Busy, match="another client"):
        robot[Driving].drive(Twist(x=0.2), source="one")
    link.held_by("")
    await lease.release()
    assert faults(robot) == {}
    link.held_by(OTHERS)
    link.move_to(LinkState.LOST, "gone")
    with pytest.raises(Unconnected):
        await lease.take()
