"""Execution of an update of the robot's software."""

from __future__ import annotations

import asyncio
import logging

from roboglot.model.components.system.firmware import Firmware, FirmwarePackage
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE

log = logging.getLogger(__name__)


class Updater:
    """Download, installation, restart; one at a time."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._task: asyncio.Task[None] | None = None
        self.failed = False  # whether the last update failed

    @property
    def busy(self) -> bool:
        """True while an update is under way."""
        return self._task is not None and not self._task.done()

    def begin(self, package: FirmwarePackage) -> None:
        """Start with a package; one without a URL needs no download."""
        self.failed = False
        work = self._update(self._robot[Firmware], package)
        self._task = asyncio.get_running_loop().create_task(work, name="update")

    def close(self) -> None:
        """Abort the update."""
        if self._task is not None:
            self._task.cancel()

    async def _update(self, firmware: Firmware, package: FirmwarePackage) -> None:
        try:
            await firmware.download(package, source=SOURCE).succeeded()
            await firmware.install(package.digest, source=SOURCE).succeeded()
            firmware.reboot(source=SOURCE)
        except RobotError as error:
            self.failed = True
            log.warning("the update of robot %s failed: %s", self._robot.id, error)
