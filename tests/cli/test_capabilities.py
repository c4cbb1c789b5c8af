"""The capability page is what the code says, and the code is read rightly."""

from pathlib import Path

from roboglot.cli.capabilities import DRIVERS, PAGE, Kind, page
from roboglot.cli.needs import needs_of
from roboglot.model.components.base import Base
from roboglot.model.components.driving import Driving
from roboglot.model.components.gimbal import Gimbal
from roboglot.model.components.odometry import Odometry
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster import chassis, gimbal

ROOT = Path(__file__).parents[2]


def test_the_page_is_current() -> None:
    assert (ROOT / PAGE).read_text(encoding="utf-8") == page(), "run: roboglot capabilities --write"


def test_needs_follow_the_functions_that_a_handler_calls() -> None:
    assert needs_of(chassis.set_speed) == {Driving}  # through _drive
    assert needs_of(chassis.get_speed) == {Odometry, Base}  # through readings.speed
    assert needs_of(gimbal.get_attitude) == {Gimbal}


async def knows_without(robot: Robot) -> object:
    return robot[Gimbal] if Gimbal in robot else robot[Base]


def test_what_is_asked_for_is_optional() -> None:
    assert needs_of(knows_without) == {Base}


def test_verdicts() -> None:
    kind = Kind("some", frozenset({Base, Driving}), {Base: "in pulses"})
    assert kind.judge(frozenset({Driving})) == "exact"
    assert kind.judge(frozenset({Driving, Base})) == "nearly"
    assert kind.judge(frozenset({Gimbal})) == "refused"


def test_what_drivers_announce_is_what_they_add() -> None:
    """But for what autonomy adds, and what only some robots have."""
    text = page()
    for name in DRIVERS:
        assert f"## What `{name}` does nearly" in text
