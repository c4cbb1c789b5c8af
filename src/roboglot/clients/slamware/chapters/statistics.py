"""Chapter "statistics": its operations as typed methods."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call


class Statistics(Chapter):
    """Chapter "statistics"."""

    @call("GET /api/core/statistics/v1/odometry")
    async def get_odometry(self) -> float:
        """Return the travelled distance, m."""

    @call("GET /api/core/statistics/v1/runtime")
    async def get_runtime(self) -> float:
        """Return the running time, s of robot time."""
