"""Chapter "delivery": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import TaskMoveOptions
from roboglot.wire.slamware.chapters.delivery import (
    AdminPassword,
    Configuration,
    Language,
    LineSpeed,
    OperationReply,
    Password,
    TimeoutChange,
    VoicePackages,
    WorkingTime,
    WorkModeEntry,
    WrappedSettings,
)


class Admin(Chapter):
    """Chapter "delivery"."""

    @call("GET /api/delivery/v1/admin/password")
    async def get_password(self) -> AdminPassword:
        """Return the password of the robot's settings screen; it never expires."""

    @call("PUT /api/delivery/v1/admin/password")
    async def set_password(self, body: Password | None = None) -> OperationReply:
        """Set or remove the password of the screen; it does not protect the API."""

    @call("GET /api/delivery/v1/admin/mode")
    async def get_work_mode(self) -> WorkModeEntry:
        """Return the kinds of tasks that may be created at the robot."""

    @call("PUT /api/delivery/v1/admin/mode")
    async def set_work_mode(self, body: WorkModeEntry) -> OperationReply:
        """Set the tasks that may be created at the robot: DISPATCH none, RECYCLE collecting dishes, MANUAL all."""

    @call("GET /api/delivery/v1/admin/language")
    async def get_language(self) -> Language:
        """Return the language; Chinese by default."""

    @call("PUT /api/delivery/v1/admin/language")
    async def set_language(self, body: Language) -> OperationReply:
        """Set the language."""

    @call("GET /api/delivery/v1/admin/working_time")
    async def get_working_time(self) -> WorkingTime:
        """Return the working hours, UTC; without hours: always."""

    @call("PUT /api/delivery/v1/admin/working_time")
    async def set_working_time(self, body: WorkingTime) -> OperationReply:
        """Set the hours (UTC) outside of which the robot rests on its dock and tasks wait."""

    @call("GET /api/delivery/v1/admin/move_options")
    async def get_move_options(self) -> TaskMoveOptions:
        """Return the drive settings of tasks."""

    @call("PUT /api/delivery/v1/admin/move_options")
    async def set_move_options(self, body: dict[str, object]) -> OperationReply:
        """Change the given settings, from the next drive on; an empty body restores the defaults."""

    @call("GET /api/delivery/v1/admin/line_speed")
    async def get_line_speed(self) -> LineSpeed:
        """Return the speeds to people and back, m/s; the robot's limit if never set."""

    @call("PUT /api/delivery/v1/admin/line_speed")
    async def set_line_speed(self, body: LineSpeed) -> None:
        """Set the speeds, from the next drive on; never above the robot's limit."""

    @call("GET /api/delivery/v1/configurations")
    async def get_configurations(self) -> Configuration:
        """Return the description of the machine."""

    @call("GET /api/delivery/v1/settings")
    async def get_delivery_settings(self) -> WrappedSettings:
        """Return battery levels (percent) and time-outs (s)."""

    @call("PUT /api/delivery/v1/settings/timeout")
    async def set_timeout_settings(self, body: TimeoutChange) -> None:
        """Set the robot's wait for a pickup, s."""

    @call("GET /api/delivery/v1/voice_resources")
    async def get_voice_resources(self) -> VoicePackages:
        """Return the voice packages from the cloud; none without a cloud that manages this robot."""
