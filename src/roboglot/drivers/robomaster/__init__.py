"""A real robot behind DJI's plain-text SDK (RoboMaster EP). Knows the client and the model, no door."""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.drivers.driver import Driver
from roboglot.drivers.driver_type import DriverType, Target, Workshop
from roboglot.model.components.component import Component
from roboglot.model.robot import Robot

BOUNDED = "move"  # the way to drive an EP, unless ``drive=speed``
PORT_OPTIONS = ("event", "video", "audio", "push")


def _make(workshop: Workshop, robot: Robot, target: Target) -> Driver:
    from roboglot.clients.robomaster.client import Ports
    from roboglot.clients.robomaster.datagrams import PushPort
    from roboglot.drivers.robomaster.driver import Endpoint, RoboMasterDriver
    from roboglot.drivers.robomaster.watchdog import Watchdog

    if (drive := target.options.get("drive", BOUNDED)) not in (BOUNDED, "speed"):
        raise ValueError(f"{target.url}: drive is {BOUNDED} (moves that end by themselves) or speed, not {drive}")
    given = {name: target.port_option(name, 0) for name in PORT_OPTIONS if name in target.options}
    if target.port:
        given["control"] = target.port
    ports, local = Ports(**given), target.options.get("local")
    return RoboMasterDriver(
        robot,
        target.url,
        Endpoint(target.host, ports, local, bounded=drive == BOUNDED),
        pushes=workshop.shared((PushPort, local, ports.push), lambda: PushPort(local or "", ports.push)),
        watchdog=workshop.shared(Watchdog, Watchdog),
        own=workshop.own,
        touches=workshop.touches,
    )


def _announced() -> Mapping[type[Component], str]:
    from roboglot.drivers.robomaster.capabilities import APPROXIMATIONS

    return APPROXIMATIONS


DRIVER = DriverType("robomaster", _make, _announced, options=frozenset(("local", "drive", *PORT_OPTIONS)))
