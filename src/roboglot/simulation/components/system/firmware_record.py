"""Record of a robot's firmware over reboots and crashes, kept in its settings, if it has any."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import convert, to_builtins

from roboglot.model.components.system.firmware import FirmwarePackage
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot

INSTALLED, PENDING, AUTOMATIC = "firmware.installed", "firmware.pending", "firmware.automatic"
DOWNLOADED = "firmware.downloaded"

Versions = tuple[str, Mapping[str, str]]
"""Of the whole, and of its modules by name."""


class FirmwareRecord:
    """Installed, pending and downloaded versions; ``version`` and ``modules`` are the factory's.

    Values put here are safe on disk when the call returns.
    """

    def __init__(self, robot: Robot, version: str, modules: Mapping[str, str]) -> None:
        self._robot, self._factory = robot, (version, modules)
        self._kept: dict[str, object] = {}  # for a robot without settings
        self._awake = False  # whether the state left by the previous run is loaded
        self._booted: Versions | None = None  # the versions installed before the last reboot: they are running by now

    def wake(self) -> FirmwarePackage | None:
        """Restore the state of the previous run, once; return its downloaded package."""
        if self._awake or Settings not in self._robot:
            return None
        return self.restart()

    def restart(self) -> FirmwarePackage | None:
        """Run the pending versions; return the downloaded package."""
        self._awake, self._booted = True, self._versions(PENDING) or self._booted
        left = self._read(DOWNLOADED)
        return convert(left, FirmwarePackage) if left else None

    @property
    def installed(self) -> Versions:
        """Running versions of the whole and of its modules."""
        return self._booted or self._versions(INSTALLED) or self._factory

    @property
    def automatic(self) -> bool:
        """True if the robot updates itself."""
        return bool(self._read(AUTOMATIC))

    async def set_automatic(self, on: bool) -> None:
        """Switch automatic updates."""
        await self._write(AUTOMATIC, on)

    async def put_downloaded(self, package: FirmwarePackage | None) -> None:
        """Keep the downloaded package; None: there is none."""
        await self._write(DOWNLOADED, to_builtins(package))

    async def put_pending(self, version: str, modules: Mapping[str, str]) -> None:
        """Keep the versions that run after the next reboot."""
        await self._write(PENDING, [version, modules])

    async def boot(self) -> None:
        """Make the pending versions the running ones."""
        if pending := self._read(PENDING):
            await self._write(INSTALLED, pending)
            await self._write(PENDING, None)
            self._booted = None

    def _versions(self, key: str) -> Versions | None:
        kept = self._read(key)
        return convert(kept, tuple[str, dict[str, str]]) if kept else None

    def _read(self, key: str) -> object:
        return self._robot[Settings].get(key) if Settings in self._robot else self._kept.get(key)

    async def _write(self, key: str, value: object) -> None:
        if Settings in self._robot:
            await self._robot[Settings].put(key, value)
        else:
            self._kept[key] = value
