"""Chapters "firmware" and "application": their operations as typed methods."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import InstalledApp, Outcome, UpdateProgress
from roboglot.wire.slamware.chapters.firmware.firmware import FirmwareInfo
from roboglot.wire.slamware.chapters.slam.localization import Switch


class Firmware(Chapter):
    """Updates, and installed apps."""

    @call("GET /api/core/firmware/v1/newversion")
    async def get_new_version(self) -> FirmwareInfo:
        """Return the offered firmware, if it is newer than the running one."""

    @call("GET /api/core/firmware/v1/autoupdate/:enable")
    async def get_enable_auto_update(self) -> bool:
        """Return True if the robot updates itself on its dock."""

    @call("PUT /api/core/firmware/v1/autoupdate/:enable")
    async def set_enable_auto_update(self, body: Switch) -> None:
        """Switch automatic updates."""

    @call("POST /api/core/firmware/v1/autoupdate/:start")
    async def start_update(self) -> Outcome:
        """Download the newest version, install it and restart."""

    @call("POST /api/core/firmware/v1/update/:start")
    async def upload_and_start_update(self, body: bytes) -> Outcome:
        """Upload firmware and start the update."""

    @call("GET /api/core/firmware/v1/progress")
    async def get_firmware_progress(self) -> UpdateProgress:
        """Return the progress of the update."""

    @call("GET /api/core/application/v1/apps")
    async def get_apps(self) -> list[InstalledApp]:
        """Return the installed apps."""

    @call("POST /api/core/application/v1/apps")
    async def install_app(self, body: bytes) -> None:
        """Install an Android app."""

    @call("DELETE /api/core/application/v1/apps/{app_name}")
    async def delete_app(self, app_name: str) -> None:
        """Remove one, or 404."""
