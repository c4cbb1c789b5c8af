"""What the dog tells of itself, as components over the newest."""

from __future__ import annotations

from roboglot.drivers.cyberdog.newest import Newest
from roboglot.model.clock import Clock
from roboglot.model.components.odometry import Odometry
from roboglot.model.sensing import OdometryReading


class CyberDogOdometry(Odometry):
    """Reckoned; see ``Newest``."""

    def __init__(self, clock: Clock, newest: Newest) -> None:
        self._clock, self._newest = clock, newest

    @property
    def reading(self) -> OdometryReading:
        return self._newest.reckon(self._clock.time())
