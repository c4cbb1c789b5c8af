"""The robot's own software: versions of its modules, updates with progress, reboots."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import field
from enum import StrEnum

from roboglot.model.action import Action
from roboglot.model.components.component import Component
from roboglot.values import dataclass

FIRMWARE = "firmware"  # the resource of updates and reboots
PACKAGE_BYTES_MAX = 4 * 1024**3
MODULES_MAX = 64


class Module(StrEnum):
    """A part of the firmware that can be restarted while the rest keeps running."""

    SOFTWARE = "software"  # mapping, planning and everything above the drive
    BASE = "base"  # the drive's controller


class FirmwareState(StrEnum):
    """Stage of a firmware update."""

    IDLE = "idle"
    DOWNLOADING = "downloading"
    DOWNLOADED = "downloaded"
    INSTALLING = "installing"
    INSTALLED = "installed"  # becomes the running version at the next reboot
    REBOOTING = "rebooting"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class FirmwarePackage:
    """An update: ``modules`` are the versions that it brings, ``size`` in bytes, ``digest`` (the start of) its MD5.

    ``url``: its address; "" for one that was handed over and needs no download.
    """

    version: str
    size: int
    digest: str
    modules: Mapping[str, str] = field(default_factory=dict)
    url: str = ""
    notes: str = ""


@dataclass(frozen=True, slots=True)
class FirmwareProgress:
    """``share`` 0..1 of the current step; ``error`` in plain words after a failure."""

    state: FirmwareState = FirmwareState.IDLE
    share: float = 0.0
    package: FirmwarePackage | None = None
    error: str = ""


class Firmware(Component):
    """Updates and reboots; every change publishes ``FirmwareChanged``, percent by percent.

    A reboot publishes ``Rebooting``: the runtime closes the robot's doors then and opens them again at
    ``Rebooted``. The restart of a module publishes ``ModuleRestarting`` and ``ModuleRestarted``. Installed versions
    survive a crash; a power cut during an installation leaves the old version.
    """

    @property
    @abstractmethod
    def version(self) -> str:
        """Running version of the firmware as a whole."""

    @property
    @abstractmethod
    def modules(self) -> Mapping[str, str]:
        """Running version of each module."""

    @property
    @abstractmethod
    def progress(self) -> FirmwareProgress:
        """Current state."""

    @property
    @abstractmethod
    def available(self) -> FirmwarePackage | None:
        """Package that the manufacturer offers, if newer than the running version; else None."""

    @property
    @abstractmethod
    def automatic(self) -> bool:
        """True if the robot updates itself while idle on its dock."""

    @abstractmethod
    async def set_automatic(self, on: bool) -> None:
        """Switch ``automatic``; return once it is on disk."""

    @property
    @abstractmethod
    def remaining(self) -> float | None:
        """Estimated s until the update under way is installed; None when there is none."""

    @abstractmethod
    def download(self, package: FirmwarePackage, *, source: str = "") -> Action:
        """Download a package. Raises InvalidGoal for a malformed one; aborts with Refused when the disk is full.

        Feedback of all three actions: ``FirmwareProgress``.
        """

    @abstractmethod
    def install(self, digest: str, *, source: str = "") -> Action:
        """Install the downloaded package. Aborts with NotFound for another digest, Refused with a low battery."""

    @abstractmethod
    async def discard(self) -> None:
        """Delete the downloaded package, or the record of a failure; return once that is on disk.

        Raises Refused while an update is under way, and for an installed one.
        """

    @abstractmethod
    def reboot(self, *, source: str = "", after: float = 0.0) -> Action:
        """Restart in ``after`` s: all actions are cancelled, and the installed version becomes the running one.

        Raises Busy while an update is downloaded or installed.
        """

    @property
    @abstractmethod
    def restarting(self) -> Module | None:
        """Module that is restarting while the rest stays up, or None."""

    @abstractmethod
    def restart(self, module: Module, *, source: str = "") -> Action:
        """Restart one module; the robot stands until it is back.

        A restart of the software cancels all actions, one of the base cancels motions.
        """
