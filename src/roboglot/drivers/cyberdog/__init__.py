"""A real CyberDog 2 behind its app protocol. Knows the client and the model, no door."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from roboglot.drivers.driver import Driver
from roboglot.drivers.driver_type import DriverType, Target, Workshop
from roboglot.model.components.component import Component
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.clients.cyberdog import Certificates

log = logging.getLogger(__name__)
PLAINTEXT = "none"  # instead of a folder of certificates


def _make(workshop: Workshop, robot: Robot, target: Target) -> Driver:
    from roboglot.drivers.cyberdog.driver import CyberDogDriver
    from roboglot.wire.cyberdog.channel import APP_PORT, ROBOT_PORT

    if "certs" not in target.options:
        raise ValueError(f"{target.url}: a CyberDog requires certificates: cyberdog://HOST?certs=FOLDER")
    folder, port = target.options["certs"], target.port or ROBOT_PORT
    app_port = target.port_option("app", APP_PORT)

    def certificates() -> Certificates | None:
        return None if folder == PLAINTEXT else _load(Path(folder))

    return CyberDogDriver(
        robot, target.url, target.host, port, certificates, app_port=app_port, touches=workshop.touches
    )


def _load(folder: Path) -> Certificates:
    from roboglot.clients.cyberdog import Certificates
    from roboglot.clients.errors import LinkLost

    try:
        return Certificates.load(folder)
    except OSError as error:
        log.warning("cannot read the certificates in %s: %s", folder, error)
        raise LinkLost(f"cannot read its certificates: {error.strerror or 'damaged file'}") from None


def _announced() -> Mapping[type[Component], str]:
    from roboglot.drivers.cyberdog.capabilities import APPROXIMATIONS

    return APPROXIMATIONS


DRIVER = DriverType("cyberdog", _make, _announced, options=frozenset(("certs", "app")), example=f"certs={PLAINTEXT}")
