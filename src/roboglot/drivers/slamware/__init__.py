"""A real robot behind Slamtec's Slamware REST API. Knows the client and the model, no door."""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.drivers.driver import Driver
from roboglot.drivers.driver_type import DriverType, Target, Workshop
from roboglot.model.components.component import Component
from roboglot.model.robot import Robot


def _make(workshop: Workshop, robot: Robot, target: Target) -> Driver:
    from roboglot.drivers.slamware.driver import PORT, SlamwareDriver

    return SlamwareDriver(robot, target.url, target.host, target.port or PORT, touches=workshop.touches)


def _announced() -> Mapping[type[Component], str]:
    from roboglot.drivers.slamware.capabilities import APPROXIMATIONS

    return APPROXIMATIONS


DRIVER = DriverType("slamware", _make, _announced)
