"""Chapters "low power", "developer", "environment", "logs" and "calibration": 9030, 9031, 10002 to 10006, 12001."""

from __future__ import annotations

from roboglot.clients.cyberdog.calls import Calls
from roboglot.wire.cyberdog.codes import Code


class Upkeep(Calls):
    """Power, developer access, logs, calibration."""

    async def unlock(self, link: str) -> None:
        """9030: unlock developer access with the key at ``link``."""
        await self.do(Code.UNLOCK, {"httplink": link}, within=15.0)

    async def reboot(self) -> None:
        """9031: reboot."""
        await self.do(Code.REBOOT)

    async def leave_low_power(self) -> None:
        """10002: leave the low-power mode."""
        await self.do(Code.LEAVE_LOW_POWER, within=15.0)

    async def set_automatic_low_power(self, on: bool) -> None:
        """10003: switch the automatic low-power mode."""
        await self.do(Code.AUTOMATIC_LOW_POWER, {"data": on})

    async def set_work_environment(self, environment: str) -> None:
        """10004: set the environment, "pro" or "test"."""
        await self.do(Code.WORK_ENVIRONMENT, {"data": environment})

    async def upload_log(self) -> None:
        """10005: upload the log."""
        await self.do(Code.UPLOAD_LOG, within=65.0)

    async def power_off(self) -> None:
        """10006: switch the robot off."""
        await self.do(Code.POWER_OFF)

    async def calibrate_legs(self, power: bool) -> None:
        """12001: False: lie down and release the motors. True: power the motors and stand up."""
        await self.do(Code.CALIBRATE_LEGS, {"data": power}, within=15.0)
