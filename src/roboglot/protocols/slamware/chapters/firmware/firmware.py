"""Chapters "firmware" and "application": updates from the manufacturer, installed apps."""

from __future__ import annotations

import uuid

import msgspec

from roboglot.model.components.system.apps import Apps
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import Firmware, FirmwarePackage, FirmwareState
from roboglot.model.errors import Refused, RobotError
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.firmware.uploads import Upload
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.firmware.apk import read_apk
from roboglot.wire.slamware.chapters.firmware.firmware import FirmwareInfo
from roboglot.wire.slamware.chapters.firmware.packages import BadPackage, read_firmware
from roboglot.wire.slamware.chapters.slam.localization import Switch

API, APPS = "/api/core/firmware/v1", "/api/core/application/v1/apps"
SUCCESS, ERROR, INIT, UPGRADE = range(4)
STEPS = ("Preparing", "PrepareFinished", "Downloading", "DownloadFinished", "Updating", "UpdateFinished")
PROGRESS = {
    FirmwareState.IDLE: (0, INIT),
    FirmwareState.DOWNLOADING: (2, UPGRADE),
    FirmwareState.DOWNLOADED: (3, INIT),  # under way only while an update goes on to install it
    FirmwareState.INSTALLING: (4, UPGRADE),
    FirmwareState.INSTALLED: (5, SUCCESS),
    FirmwareState.REBOOTING: (5, SUCCESS),
    FirmwareState.FAILED: (0, ERROR),
}


IDLE = (FirmwareState.IDLE, FirmwareState.DOWNLOADED, FirmwareState.FAILED)  # states in which an update may begin


class Outcome(msgspec.Struct):
    """Result of a request to start; ``reason`` if it was refused."""

    result: bool
    reason: str


class UploadOutcome(msgspec.Struct):
    """Result of an upload; ``msg``: reason of a refusal, ``data``: the version."""

    result: bool
    msg: str
    data: dict[str, str]


class UpdateProgress(msgspec.Struct):
    """The step (see ``STEPS``), its share in percent; ``status``: 0 success, 1 error, 2 nothing begun, 3 under way."""

    current_step: int
    current_step_name: str
    current_step_progress: int
    total_steps: int = msgspec.field(name="toptalSteps")  # the vendor's spelling
    status: int
    error_code: int


class InstalledApp(msgspec.Struct):
    """An app."""

    name: str
    version: str


@TABLE.on(f"GET {API}/newversion", right=Right.SEE, needs=(Firmware,))
def get_new_version(context: Context) -> FirmwareInfo:
    """Return the version offered by the manufacturer, if newer than the running one."""
    plate = context.robot.description
    if (package := context.robot[Firmware].available) is None:
        return FirmwareInfo()
    return FirmwareInfo(plate.maker, plate.model, package.version, str(uuid.UUID(package.digest)))


@TABLE.on(f"GET {API}/autoupdate/:enable", right=Right.SEE, needs=(Firmware,))
def get_enable_auto_update(context: Context) -> bool:
    """Return whether the robot updates itself on its dock."""
    return context.robot[Firmware].automatic


@TABLE.on(f"PUT {API}/autoupdate/:enable", right=Right.ADMIN, needs=(Firmware,))
async def set_enable_auto_update(context: Context, body: Switch) -> None:
    """Switch automatic updates on the dock."""
    await context.robot[Firmware].set_automatic(body.enable)


@TABLE.on(f"POST {API}/autoupdate/:start", right=Right.ADMIN, needs=(Firmware,))
def start_update(context: Context) -> Outcome:
    """Download the newest version, install it and restart."""
    firmware = context.robot[Firmware]
    if firmware.available is None:
        return Outcome(result=False, reason="there is no newer version")
    if context.updater.busy or firmware.progress.state not in IDLE:  # also one that the robot or another door began
        return Outcome(result=False, reason="an update is under way")
    context.updater.begin(firmware.available)
    return Outcome(result=True, reason="")


@TABLE.on(f"POST {API}/update/:start", right=Right.ADMIN, needs=(Disk, Firmware))
def upload_and_start_update(context: Context, body: Upload) -> UploadOutcome:
    """Install the uploaded package, whatever its version, and restart; a zip archive with ``firmware.json``."""
    firmware, plate = context.robot[Firmware], context.robot.description
    if context.updater.busy or firmware.progress.state not in IDLE:
        return UploadOutcome(result=False, msg="an update is under way", data={})
    try:
        found = read_firmware(body.file)
    except BadPackage as error:
        return UploadOutcome(result=False, msg=f"no firmware package: {error}", data={})
    if found.model not in ("", plate.model):
        return UploadOutcome(result=False, msg=f"the firmware is for {found.model}", data={})
    if context.robot[Disk].free < body.size:
        return UploadOutcome(result=False, msg="no room on the disk", data={})
    context.updater.begin(FirmwarePackage(found.version, body.size, body.digest, found.modules, notes=found.notes))
    return UploadOutcome(result=True, msg="", data={"version": found.version})


@TABLE.on(f"GET {API}/progress", right=Right.SEE, needs=(Firmware,))
def get_firmware_progress(context: Context) -> UpdateProgress:
    """Return the progress of the update."""
    progress = context.robot[Firmware].progress
    step, status = PROGRESS[progress.state]
    if progress.state in IDLE:
        if context.updater.busy:  # it prepares, whatever an earlier update left
            status = UPGRADE
        elif context.updater.failed:
            status = ERROR
    share = round(progress.share * 100)
    return UpdateProgress(step, STEPS[step], share, len(STEPS), status, int(status == ERROR))


@TABLE.on(f"GET {APPS}", right=Right.SEE, needs=(Apps,))
def get_apps(context: Context) -> list[InstalledApp]:
    """Return the installed apps."""
    return [InstalledApp(app.name, app.version) for app in context.robot[Apps].all()]


@TABLE.on(f"POST {APPS}", right=Right.ADMIN, needs=(Apps,))
async def install_app(context: Context, body: Upload) -> None:
    """Install or update an Android package (APK); 400 for a malformed one, 500 without disk space."""
    try:
        app = read_apk(body.file)
        await context.robot[Apps].install(app.name, app.version, body.file)
    except (BadPackage, RobotError) as error:
        status = 500 if isinstance(error, Refused) else 400  # the manual only knows 500
        raise HttpError(status, "Failed to install application", str(error)) from None


@TABLE.on(f"DELETE {APPS}/{{app_name}}", right=Right.ADMIN, needs=(Apps,))
async def delete_app(context: Context, app_name: str) -> None:
    """Remove an app; 404 if there is none."""
    await context.robot[Apps].remove(app_name)
