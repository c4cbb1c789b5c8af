"""Chapters "firmware" and "application": updates from the maker, installed apps."""

from __future__ import annotations

import uuid

import msgspec

from roboglot.model.components.apps import Apps
from roboglot.model.components.firmware import Firmware, FirmwareState
from roboglot.protocols.slamware.operations import OPERATIONS, Desk
from roboglot.wire.slamware.slam import Switch

API, APPS = "/api/core/firmware/v1", "/api/core/application/v1/apps"
SUCCESS, ERROR, INIT, UPGRADE = range(4)
STEPS = ("Preparing", "PrepareFinished", "Downloading", "DownloadFinished", "Updating", "UpdateFinished")
PROGRESS = {
    FirmwareState.IDLE: (0, INIT),
    FirmwareState.DOWNLOADING: (2, UPGRADE),
    FirmwareState.DOWNLOADED: (3, UPGRADE),
    FirmwareState.INSTALLING: (4, UPGRADE),
    FirmwareState.INSTALLED: (5, SUCCESS),
    FirmwareState.REBOOTING: (5, SUCCESS),
    FirmwareState.FAILED: (0, ERROR),
}


class FirmwareInfo(msgspec.Struct, omit_defaults=True):
    """A version that the maker offers; nothing in it: there is none."""

    manufacturer: str = ""
    model: str = ""
    firmware: str = ""
    firmware_id: str = ""


class Outcome(msgspec.Struct):
    """Whether it has begun, and why not."""

    result: bool
    reason: str


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


@OPERATIONS.on(f"GET {API}/newversion")
async def get_new_version(desk: Desk) -> FirmwareInfo:
    """What the maker offers, if it is newer than what runs."""
    plate = desk.robot.description
    if (package := desk.robot[Firmware].available) is None:
        return FirmwareInfo()
    return FirmwareInfo(plate.maker, plate.model, package.version, str(uuid.UUID(package.digest)))


@OPERATIONS.on(f"GET {API}/autoupdate/:enable")
async def get_enable_auto_update(desk: Desk) -> bool:
    """Whether the robot updates itself on its dock."""
    return desk.robot[Firmware].automatic


@OPERATIONS.on(f"PUT {API}/autoupdate/:enable")
async def set_enable_auto_update(desk: Desk, body: Switch) -> None:
    """Let it, or not."""
    await desk.robot[Firmware].set_automatic(body.enable)


@OPERATIONS.on(f"POST {API}/autoupdate/:start")
async def start_update(desk: Desk) -> Outcome:
    """Download the newest version, install it and restart."""
    firmware = desk.robot[Firmware]
    if firmware.available is None:
        return Outcome(result=False, reason="there is no newer version")
    if desk.updater.busy:
        return Outcome(result=False, reason="an update is under way")
    desk.updater.begin()
    return Outcome(result=True, reason="")


@OPERATIONS.on(f"GET {API}/progress")
async def get_firmware_progress(desk: Desk) -> UpdateProgress:
    """How far the update is."""
    progress = desk.robot[Firmware].progress
    step, status = PROGRESS[progress.state]
    share = round(progress.share * 100)
    return UpdateProgress(step, STEPS[step], share, len(STEPS), status, int(status == ERROR))


@OPERATIONS.on(f"GET {APPS}")
async def get_apps(desk: Desk) -> list[InstalledApp]:
    """The apps that people installed."""
    return [InstalledApp(app.name, app.version) for app in desk.robot[Apps].all()]


@OPERATIONS.on(f"DELETE {APPS}/{{app_name}}")
async def delete_app(desk: Desk, app_name: str) -> None:
    """Remove one, or 404."""
    await desk.robot[Apps].remove(app_name)
