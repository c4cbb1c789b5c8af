"""Checks before motions: fitness of a robot on legs, and contacts in its way. Knows no motion."""

from __future__ import annotations

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.motors import Motors
from roboglot.model.errors import Refused
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.model.sensing import Supply
from roboglot.simulation.bodies.hull import Hull


def check_fit(robot: Robot, hull: Hull, tired_below: float, *, getting_up: bool) -> None:
    """Raise Refused for a robot unfit for motions; ``tired_below``: charge (0..1). Getting up needs less."""
    if hull.hand is not None:
        raise Refused("the robot is held up by a hand")
    if hull.overturned and not getting_up:
        raise Refused("the robot lies on its side")
    if Motors in robot and robot[Motors].hottest > robot[Motors].hot:
        raise Refused("a motor is too hot")
    if Battery not in robot or getting_up:
        return
    battery = robot[Battery].state
    if battery.percentage <= tired_below:
        raise Refused("the battery is too low for this")
    if battery.supply is Supply.WIRE:
        raise Refused("the robot is charging by wire")


def in_the_way(hull: Hull, twist: Twist) -> bool:
    """True if the hull has a contact in its direction of motion (base_link)."""
    return any(touch.x * twist.x + touch.y * twist.y > 0.0 for touch in hull.touches)
