"""Downloads, installs and reports updates (pushes 5001, 5005, 5007, 5008); ``ota.py`` answers the app."""

from __future__ import annotations

import asyncio
import contextlib
import logging

import msgspec

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.system.firmware import Firmware, FirmwarePackage, FirmwareProgress, FirmwareState
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, NotFound, Refused, RobotError
from roboglot.model.events import FirmwareChanged
from roboglot.model.robot import Robot
from roboglot.operations import BadParameters
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.chapters.system.stored_settings import UPDATE, kept
from roboglot.protocols.cyberdog.table import push
from roboglot.validation import why_invalid
from roboglot.wire.cyberdog.codes import Code

log = logging.getLogger(__name__)
STATUS = push(Code.UPDATE_STATUS)
PROGRESS = push(Code.UPDATE_PROGRESS)
REBOOTS = push(Code.UPDATE_REBOOT)
RESULT = push(Code.UPDATE_RESULT)
GOOD, FAILED, STATE, ARGUMENTS, BUSY = 0, 5701, 5703, 5710, 5711  # ``code``
PROGRESS_FAILED, DISK_FULL = -1, -2
NOTICE = 3.0  # s between announcing the reboot and rebooting
MODULES_MAX = 16
PROGRESS_PERIOD = 0.1  # s between two pushes of progress
WORDS = {
    FirmwareState.DOWNLOADING: "download",
    FirmwareState.INSTALLING: "update",
    FirmwareState.INSTALLED: "update",
    FirmwareState.REBOOTING: "update",
}
UNDER_WAY = frozenset(WORDS)


class WirePackage(msgspec.Struct):
    """A file of an update."""

    md5: str
    fileSize: int  # noqa: N815 - the wire's name
    version: str = ""


class WireLatest(msgspec.Struct):
    """Latest version offered for a module."""

    version: str
    packages: list[WirePackage]


class WireModule(msgspec.Struct):
    """A module to be updated."""

    module: str
    latest: WireLatest


class Updates:
    """Reports updates to the app, no matter who began them. Lives as long as the door is open."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self.digests: frozenset[str] = frozenset()  # of all files in the download
        self._robot, self._app = robot, app
        self._failed = 0  # the progress reported after a failed download
        self._word = "idle"
        self._state = FirmwareState.IDLE
        self._sent: dict[str, int] = {}  # the last progress pushed
        self._sent_at = -PROGRESS_PERIOD
        self._working: asyncio.Task[None] | None = None
        self._leave = robot.events.listen(FirmwareChanged, lambda event: self._changed(event.progress))
        app.on_found.append(self._report_result)

    def progress(self) -> dict[str, int]:
        """Return the progress as in 5005."""
        progress = self._robot[Firmware].progress
        share = round(100 * progress.share)
        match progress.state:
            case FirmwareState.DOWNLOADING:
                return _progress(share, 0)
            case FirmwareState.DOWNLOADED:
                return _progress(100, 0)
            case FirmwareState.INSTALLING:
                return _progress(0, share)
            case FirmwareState.INSTALLED | FirmwareState.REBOOTING:
                return _progress(0, 100)
            case FirmwareState.FAILED:
                return _progress(self._failed or PROGRESS_FAILED, 0, FAILED)
        return _progress(self._failed, 0, FAILED if self._failed else GOOD)

    def download(self, package: FirmwarePackage, digests: frozenset[str]) -> Action:
        """Start a download; ``digests``: of all files. Raises InvalidGoal for a malformed package."""
        action = self._robot[Firmware].download(package, source=SOURCE)
        self.digests, self._failed = digests, 0

        async def watch() -> None:
            if await action.done() is ActionStatus.SUCCEEDED:
                return
            self._failed = DISK_FULL if isinstance(action.error, Refused) else PROGRESS_FAILED
            self._app.push(PROGRESS, _progress(self._failed, 0, FAILED))

        self._working = asyncio.get_running_loop().create_task(watch(), name="download")
        return action

    def obstacle(self, md5: str) -> int:
        """Return the ``code`` of the obstacle to installing the download (if ``md5`` names it); GOOD without one."""
        progress = self._robot[Firmware].progress
        if progress.state in UNDER_WAY:
            return BUSY
        if progress.state is not FirmwareState.DOWNLOADED or progress.package is None:
            return STATE
        return GOOD if md5.lower() in self.digests | {progress.package.digest} else ARGUMENTS

    def install(self) -> None:
        """Install the download and restart; the app gets the result when it is connected again."""
        self._working = asyncio.get_running_loop().create_task(self._install(), name="install")

    def close(self) -> None:
        """Send no more reports; running work continues."""
        self._leave()
        if self._working:
            self._working.cancel()

    async def _install(self) -> None:
        with contextlib.suppress(RobotError):  # reported to the app
            await self.installed()
            self.restart()

    async def installed(self) -> None:
        """Install the download; a failure is reported to the app, and raised as RobotError."""
        firmware = self._robot[Firmware]
        package = firmware.progress.package
        if package is None:
            raise NotFound("no update was downloaded")
        try:
            await firmware.install(package.digest, source=SOURCE).succeeded()
        except RobotError as error:
            log.warning("the update failed: %s", error)
            self._app.push(PROGRESS, _progress(0, PROGRESS_FAILED, FAILED))
            self._app.push(RESULT, {"success": False, "code": FAILED})
            raise
        if Settings in self._robot:
            await self._robot[Settings].put(UPDATE, package.version)

    def restart(self) -> None:
        """Notify the app, then restart."""
        self._app.push(REBOOTS, {})
        self._robot[Firmware].reboot(after=NOTICE, source=SOURCE)

    def _changed(self, progress: FirmwareProgress) -> None:
        content, now = self.progress(), self._robot.clock.time()
        if content != self._sent and (progress.state is not self._state or now - self._sent_at >= PROGRESS_PERIOD):
            self._sent, self._sent_at = content, now
            self._app.push(PROGRESS, content)
        self._state = progress.state
        word = WORDS.get(progress.state, "idle")
        if word != self._word:
            self._word = word
            self._app.push(STATUS, {"status": word, "code": GOOD})

    def _report_result(self) -> None:
        """Report after the reboot whether the robot runs what was installed."""
        wanted = kept(self._robot, UPDATE, "")
        if not wanted or Firmware not in self._robot or self._robot[Firmware].progress.state in UNDER_WAY:
            return
        success = self._robot[Firmware].version == wanted
        self._app.push(RESULT, {"success": success, "code": GOOD if success else FAILED})
        self._working = asyncio.get_running_loop().create_task(self._forget())

    async def _forget(self) -> None:
        await self._robot[Settings].put(UPDATE, "")


def _progress(download: int, upgrade: int, code: int = GOOD) -> dict[str, int]:
    return {"download_progress": download, "upgrade_progress": upgrade, "code": code}


def package_of(modules: object) -> tuple[FirmwarePackage, frozenset[str]]:
    """Return one package of a module or a list of them, and its files' checksums. Raises BadParameters, InvalidGoal."""
    try:
        wanted = msgspec.convert(modules if isinstance(modules, list) else [modules], list[WireModule])
    except msgspec.ValidationError as error:
        raise BadParameters(why_invalid(error, "the modules", wanted=list[WireModule])) from None
    files = [file for module in wanted for file in module.latest.packages]
    if not files or len(wanted) > MODULES_MAX or any(file.fileSize < 0 for file in files):
        raise InvalidGoal(f"an update needs files with their sizes and has at most {MODULES_MAX} modules")
    # The total size, and the first file's checksum for all: they are installed together.
    # The manual's example gives no size (0) and ten digits of the checksum.
    size = max(1, sum(file.fileSize for file in files))
    versions = {module.module: module.latest.version for module in wanted}
    package = FirmwarePackage(wanted[0].latest.version, size, files[0].md5.lower(), versions, url="app")
    return package, frozenset(file.md5.lower() for file in files)
