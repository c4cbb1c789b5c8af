"""Chapter "delivery": cargos and their boxes."""

from __future__ import annotations

from typing import Literal

from roboglot.model.actions import ActionStatus
from roboglot.model.components.logistics.cargo import Cargo as CargoComponent
from roboglot.model.components.logistics.cargo import Compartment
from roboglot.model.components.logistics.delivery import Delivery, OrderKind
from roboglot.model.components.mapping.places import Places
from roboglot.model.errors import NotFound
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.delivery.box_log import OPEN
from roboglot.protocols.slamware.chapters.delivery.vocabulary import box_of, entries_of, name_of, orientation_and_type
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.delivery import AssignedCargo, Box, Cargo, OperationResult

CARGOS = "/api/delivery/v1/cargos"
BOXES = f"{CARGOS}/{{cargo_id}}/boxes"
BOXED = (OrderKind.TAKEOUT, OrderKind.DISTRIBUTE, OrderKind.COLLECT, OrderKind.STATION)


def all_cargos(robot: Robot) -> list[Cargo]:
    """Return all cargos with the current state of their boxes."""
    cargo, found = robot[CargoComponent], []
    for part in cargo.compartments:
        orientation, kind = orientation_and_type(part)
        boxes = [box_of(cargo.box(id)) for id in part.boxes]
        found.append(Cargo(part.id, part.position, orientation, part.layer, kind, [], boxes))
    return found


@TABLE.on(f"GET {CARGOS}", right=Right.SEE, needs=(CargoComponent,))
def get_cargos(context: Context) -> list[Cargo]:
    """Return all cargos with the state of each box."""
    return all_cargos(context.robot)


@TABLE.on(f"GET {BOXES}", right=Right.SEE, needs=(CargoComponent,))
def get_cargo_boxes(context: Context, cargo_id: str) -> list[Box]:
    """Return the boxes of a cargo; 404 if there is none."""
    cargo = context.robot[CargoComponent]
    return [box_of(cargo.box(id)) for id in _compartment(context, cargo_id).boxes]


@TABLE.on(f"GET {BOXES}/{{box_id}}", right=Right.SEE, needs=(CargoComponent,))
def get_cargo_box(context: Context, cargo_id: str, box_id: int) -> Box:
    """Return a box; 404 if the cargo has none of that number."""
    return box_of(context.robot[CargoComponent].box(_box_id(context, cargo_id, box_id)))


@TABLE.on(f"PUT {BOXES}/{{box_id}}/{{op}}", right=Right.DRIVE, needs=(CargoComponent,))
def operate_box(context: Context, cargo_id: str, box_id: int, op: Literal[":open", ":close"]) -> None:
    """Start opening or closing a box; ``operation_result`` has the outcome."""
    cargo, id = context.robot[CargoComponent], _box_id(context, cargo_id, box_id)
    if op == ":open":
        cargo.open_box(id, source=SOURCE)
    else:
        cargo.close_box(id, source=SOURCE)


@TABLE.on(f"GET {BOXES}/{{box_id}}/operation_result", right=Right.SEE, needs=(CargoComponent,))
def get_operation_result(context: Context, cargo_id: str, box_id: int) -> OperationResult:
    """Return the last opening or closing of the box; 404 if there was none."""
    id = _box_id(context, cargo_id, box_id)
    if (action := context.boxes.last(id)) is None:
        raise NotFound(f"box {id} has not been operated yet")
    opening = action.name == OPEN
    box = box_of(context.robot[CargoComponent].box(id))
    kind: Literal["OPEN", "CLOSE"] = "OPEN" if opening else "CLOSE"
    if not action.status.ended:
        return OperationResult(kind, "IN_PROGRESS", "", cargo_id, box)
    if action.status is ActionStatus.SUCCEEDED:
        return OperationResult(kind, "DONE", "", cargo_id, box)
    reason = "FAILED_TO_OPEN_DOOR" if opening else "CLOSE_DOOR_STALLED"
    if action.status is ActionStatus.CANCELED:
        reason = action.reason or "canceled"
    return OperationResult(kind, "FAILED", reason, cargo_id, box)


@TABLE.on(f"GET {CARGOS}/assigned", right=Right.SEE, needs=(Delivery, Places))
def get_assigned_cargos(context: Context) -> list[AssignedCargo]:
    """Return the boxes that belong to takeouts that have not ended."""
    return [
        AssignedCargo(
            name_of(context.robot, order.request.target).poi_name,
            order.number,
            entry.cargo_id,
            [str(b) for b in entry.boxes],
        )
        for order in context.robot[Delivery].orders
        if not order.status.ended and order.request.kind in BOXED
        for entry in entries_of(order.request.boxes)
    ]


def _compartment(context: Context, id: str) -> Compartment:
    for part in context.robot[CargoComponent].compartments:
        if part.id == id.lower():
            return part
    raise HttpError(404, "Cargo not found", id[:64])


def _box_id(context: Context, cargo_id: str, box_id: int) -> int:
    if box_id < 0:
        raise HttpError(400, "Invalid BoxId", str(box_id))
    if box_id not in _compartment(context, cargo_id).boxes:
        raise HttpError(404, "Box not found", str(box_id))
    return box_id
