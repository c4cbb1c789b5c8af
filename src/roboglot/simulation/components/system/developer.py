"""Access for developers. The maker of simulated robots gives every robot a key at any https link that ends in its
serial number ("https://keys.example/RG-0001-a").
"""

from __future__ import annotations

from urllib.parse import urlsplit

from roboglot.model.components.system.developer import LINK_MAX, Developer
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.network import Network
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part

KEY = "developer.unlocked"
FETCHING = 0.5  # s


class SimulatedDeveloper(Developer):
    """Developer access, kept in the settings."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._open = False

    @property
    def unlocked(self) -> bool:
        return bool(self._robot[Settings].get(KEY, False)) if Settings in self._robot else self._open

    async def unlock(self, link: str) -> None:
        try:
            parts = urlsplit(link)
        except ValueError:
            parts = urlsplit("")
        if len(link) > LINK_MAX or parts.scheme not in ("http", "https") or not parts.hostname:
            raise InvalidGoal("a key's link begins with https:// and a host")
        if Network in self._robot and not self._robot[Network].state.internet:
            raise Refused("the internet cannot be reached")
        await self._robot.clock.sleep(FETCHING)
        if parts.path.rstrip("/").rpartition("/")[2] != self._robot.description.serial:
            raise NotFound("the key at this link is not this robot's")
        self._open = True
        if Settings in self._robot:
            await self._robot[Settings].put(KEY, True)


def _fit(fit: Fitting) -> SimulatedDeveloper | None:
    return SimulatedDeveloper(fit.robot) if Firmware in fit.robot else None


PART = Part(name="developer", interface=Developer, fit=_fit, after=("firmware",))
