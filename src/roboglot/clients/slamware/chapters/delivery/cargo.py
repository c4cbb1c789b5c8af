"""Chapter "delivery": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.delivery import AssignedCargo, Box, Cargo, OperationResult


class Boxes(Chapter):
    """Chapter "delivery"."""

    @call("GET /api/delivery/v1/cargos")
    async def get_cargos(self) -> list[Cargo]:
        """List all groups of boxes with the state of each box."""

    @call("GET /api/delivery/v1/cargos/{cargo_id}/boxes")
    async def get_cargo_boxes(self, cargo_id: str) -> list[Box]:
        """Return the boxes of one cargo; 404 if there is none."""

    @call("GET /api/delivery/v1/cargos/{cargo_id}/boxes/{box_id}")
    async def get_cargo_box(self, cargo_id: str, box_id: int) -> Box:
        """Return one box; 404 if the cargo has no such box."""

    @call("PUT /api/delivery/v1/cargos/{cargo_id}/boxes/{box_id}/{op}")
    async def operate_box(self, cargo_id: str, box_id: int, op: str) -> None:
        """Start opening or closing a box; ``get_operation_result`` returns the result."""

    @call("GET /api/delivery/v1/cargos/{cargo_id}/boxes/{box_id}/operation_result")
    async def get_operation_result(self, cargo_id: str, box_id: int) -> OperationResult:
        """Return the last opening or closing of the box by any client; 404 without one."""

    @call("GET /api/delivery/v1/cargos/assigned")
    async def get_assigned_cargos(self) -> list[AssignedCargo]:
        """List the boxes of takeouts that have not ended."""
