"""Chapter "platform": its operations as typed methods."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.platform import RobotEvent


class Platform(Chapter):
    """Chapter "platform"."""

    @call("GET /api/platform/v1/timestamp")
    async def get_timestamp(self) -> str:
        """Return the milliseconds since the start, as text."""

    @call("GET /api/platform/v1/events")
    async def get_events(self) -> list[RobotEvent]:
        """Return the events since the last call."""
