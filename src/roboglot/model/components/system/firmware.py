"""The robot's own software: versions of its modules, updates with progress, reboots."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from roboglot.model.action import Action
from roboglot.model.components.component import Component

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
    """An update: ``modules`` are the versions that it brings, ``size`` in bytes, ``digest`` its MD5 in hex.

    ``url``: where it lies; "" for one that was handed over and needs no download.
    """

    version: str
    size: int
    digest: str
    modules: Mapping[str, str] = field(default_factory=dict)
    url: str = ""
    notes: str = ""


@dataclass(frozen=True, slots=True)
class FirmwareProgress:
    """``share`` 0..1 of the present step; ``error`` in plain words after a failure."""

    state: FirmwareState = FirmwareState.IDLE
    share: float = 0.0
    package: FirmwarePackage | None = None
    error: str = ""


class Firmware(Component):
    """Every change publishes ``FirmwareChanged``, a whole percent at a time.

    A reboot publishes ``Rebooting``: the runtime closes the robot's doors then and opens them again at
    ``Rebooted``. The restart of a module publishes ``ModuleRestarted`` at its end. Installed versions survive a crash;
    a power cut during an installation leaves the old version.
    """

    @property
    @abstractmethod
    def version(self) -> str:
        """Running version of the whole."""

    @property
    @abstractmethod
    def modules(self) -> Mapping[str, str]:
        """Versions of the parts, as they run now."""

    @property
    @abstractmethod
    def progress(self) -> FirmwareProgress:
        """Current state."""

    @property
    @abstractmethod
    def available(self) -> FirmwarePackage | None:
        """The newest package that the maker offers, if newer than what runs; None otherwise."""

    @property
    @abstractmethod
    def automatic(self) -> bool:
        """True if the robot updates itself when it stands on its dock and has nothing to do."""

    @abstractmethod
    async def set_automatic(self, on: bool) -> None:
        """Returns when it is safe on disk."""

    @property
    @abstractmethod
    def remaining(self) -> float | None:
        """Estimated s until the update under way is installed; None when there is none."""

    @abstractmethod
    def download(self, package: FirmwarePackage, *, source: str = "") -> Action:
        """Fetch it. Raises InvalidGoal for a package that makes no sense; aborts with Refused when the disk is full.

        Feedback of all three actions: ``FirmwareProgress``.
        """

    @abstractmethod
    def install(self, digest: str, *, source: str = "") -> Action:
        """Install what was downloaded. Aborts with NotFound for another digest, Refused with a low battery."""

    @abstractmethod
    async def discard(self) -> None:
        """Throw away what was downloaded, or the memory of a failure; returns when that is safe on disk.

        Raises Refused while anything is under way, and for what is installed already.
        """

    @abstractmethod
    def reboot(self, *, source: str = "", after: float = 0.0) -> Action:
        """Restart in ``after`` s: everything under way is cancelled, what was installed becomes the version."""

    @property
    @abstractmethod
    def restarting(self) -> Module | None:
        """Module that restarts while the rest stays up; None if there is none."""

    @abstractmethod
    def restart(self, module: Module, *, source: str = "") -> Action:
        """Restart this module only: what moves is cancelled, and nothing moves until it is up again."""
