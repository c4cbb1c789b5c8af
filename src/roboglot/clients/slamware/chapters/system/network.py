"""Chapter "system": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import NetworkStatusAnswer
from roboglot.wire.slamware.chapters.system.network import ApnStatus, NetworkRequest, RouteStatus


class Network(Chapter):
    """Chapter "system": Wi-Fi, routes, the mobile operator."""

    @call("GET /api/core/system/v1/network/status")
    async def get_network_status(self) -> NetworkStatusAnswer:
        """Get the network state."""

    @call("PUT /api/core/system/v1/network/status")
    async def set_network_status(self, body: NetworkRequest) -> bool:
        """Set the network mode."""

    @call("GET /api/core/system/v1/network/route")
    async def get_network_route(self) -> RouteStatus:
        """Get the routing priority."""

    @call("PUT /api/core/system/v1/network/route")
    async def set_network_route(self, body: RouteStatus) -> None:
        """Set the routing priority."""

    @call("GET /api/core/system/v1/network/apn")
    async def get_cmlink_apn(self) -> ApnStatus:
        """Get the cmlink APN."""

    @call("PUT /api/core/system/v1/network/apn")
    async def set_cmlink_apn(self, body: ApnStatus) -> None:
        """Set the cmlink APN."""
