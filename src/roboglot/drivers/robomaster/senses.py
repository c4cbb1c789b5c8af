"""What an EP tells of how it stands."""

from __future__ import annotations

from roboglot.drivers.robomaster.newest import Newest
from roboglot.model.components.motion.motion_status import MotionFlags, MotionStatus


class RoboMasterMotionStatus(MotionStatus):
    """``chassis push status``."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def flags(self) -> MotionFlags:
        return self._newest.flags
