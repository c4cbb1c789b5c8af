"""Vocabulary of the delivery service: orders, stages, boxes, reasons."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime

from roboglot.model.actions import Action
from roboglot.model.components.logistics.cargo import BoxState, Compartment, DoorState, Stock
from roboglot.model.components.logistics.delivery import (
    BoxChoice,
    Failure,
    Order,
    OrderKind,
    OrderRequest,
    OrderStage,
    OrderStatus,
    PickUp,
)
from roboglot.model.components.mapping.floors import RideStage
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.mapping.storeys import Storeys
from roboglot.model.components.system.lease import ERRAND
from roboglot.model.events import DeliveryNews
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.errands import part_of
from roboglot.protocols.slamware.chapters.motion.home_docks import NAME
from roboglot.protocols.slamware.vocabulary import RIDE_STAGES
from roboglot.wire.slamware.chapters.delivery import (
    Box,
    CargoEntry,
    DeliveryEvent,
    DeliveryTask,
    DeliveryTaskRequest,
    LocationInfo,
    PickupResult,
    TaskRequest,
    TaskResult,
    Untaken,
)

KINDS = {
    "TAKEOUT": OrderKind.TAKEOUT,
    "GUIDE": OrderKind.GUIDE,
    "FOOD_DELIVERY": OrderKind.FOOD,
    "RETURN": OrderKind.RETURN,
    "RECYCLE": OrderKind.RECYCLE,
    "TAKEOUT_DISTRIBUTE": OrderKind.DISTRIBUTE,
}
# The manual's list of reported types has no TAKEOUT_DISTRIBUTE.
KIND_WORDS = {kind: word for word, kind in KINDS.items()} | {
    OrderKind.DISTRIBUTE: "TAKEOUT",
    OrderKind.COLLECT: "COLLECT",
    OrderKind.STATION: "STATION_TAKEOUT",
}
NO_TASKS = (OrderKind.ROUND, OrderKind.DISINFECT)  # orders without a word in the manual's list of delivery tasks
STAGES = {
    OrderStage.DRIVING_TO_STOP: "GOING_TO_TASK_POINT",
    OrderStage.AT_STOP: "ARRIVED_AT_TASK_POINT",
    OrderStage.DRIVING: "ON_DELIVERING",
    OrderStage.AT_TARGET: "ARRIVED_AT_DELIVERY_POSE",
    OrderStage.DRIVING_TO_CABINET: "GOING_TO_CABINET",
    OrderStage.AT_CABINET: "ROBOT_OPERATE_CABINET",
    OrderStage.HANDING_OVER: "USER_OPERATE_ROBOT",
}
# Types that clients know, where there are any.
REASONS = {
    Failure.NOT_TAKEN: "NO_PICKUP",
    Failure.DOOR_STUCK: "FAILED_TO_OPEN_DOOR",
    Failure.DOOR_OPEN: "CLOSE_DOOR_TIMEOUT",
    Failure.NO_BOX: "BOX_NOT_FOUND",
    Failure.NO_PLACE: "POI not found",
    Failure.UNREACHABLE: "CANNOT_REACH_TARGET",
    Failure.BLOCKED: "PATH_OCCUPIED",
    Failure.NOT_LOCALIZED: "LOCALIZATION_LOST",
    Failure.DOCK_HELD: "UNDOCK_FAILED",
    Failure.BATTERY_LOW: "LOW_BATTERY",
}
NEWS = {
    DeliveryNews.LEFT_DOCK: DeliveryEvent.START_FROM_DOCK,
    DeliveryNews.SETTINGS_CHANGED: DeliveryEvent.DELIVERY_SETTINGS_CHANGED,
    DeliveryNews.ORDER_STARTED: DeliveryEvent.DELIVERY_TASK_START,
    DeliveryNews.BACK_TO_RECEPTION: DeliveryEvent.BACK_TO_RECEPTION_FOR_FAILED_ORDER,
    DeliveryNews.NOT_TAKEN: DeliveryEvent.DELIVERY_NO_PICKUP,
    DeliveryNews.NOT_COLLECTED: DeliveryEvent.COLLECT_NO_PICKUP,
    DeliveryNews.UNDOCK_FAILED: DeliveryEvent.UNDOCK_FAILED,
    DeliveryNews.WORK_BEGAN: DeliveryEvent.START_TO_WORK,
    DeliveryNews.WORK_ENDED: DeliveryEvent.GET_OFF_WORK,
    DeliveryNews.BATTERY_LOW: DeliveryEvent.LOW_BATTERY,
    DeliveryNews.ORDER_RECEIVED: DeliveryEvent.NEW_TASK_RECEIVED,
    DeliveryNews.STATION_STARTED: DeliveryEvent.STATION_TASK_START,
    DeliveryNews.AT_CABINET: DeliveryEvent.OPERATING_CABINET,
    DeliveryNews.DISINFECT_FAILED: DeliveryEvent.DISINFECT_TASK_FAILED,
    DeliveryNews.PLACE_LOST: DeliveryEvent.LOCALIZATION_ANOMALY,
}
DOORS = {
    DoorState.OPEN: "OPEN",
    DoorState.OPENING: "OPENING",
    DoorState.CLOSING: "CLOSING",
    DoorState.CLOSED: "CLOSED",
    DoorState.HALF_OPEN: "SEMIOPEN",
}
STOCKS = {Stock.EMPTY: "EMPTY", Stock.PARTLY: "SEMIFULL", Stock.FULL: "FULL"}


def request_of(body: TaskRequest) -> OrderRequest:
    """Return the client's request in the model's words. Box "000" is number 0."""
    boxes = boxes_of(body.cargos or ())
    return OrderRequest(KINDS[body.type], body.location.poi_name, tuple(body.location.task_points), boxes)


def boxes_of(cargos: Iterable[CargoEntry]) -> tuple[BoxChoice, ...]:
    """Return the boxes of all cargos."""
    return tuple(BoxChoice(entry.cargo_id, int(box)) for entry in cargos for box in entry.boxes)


def entries_of(boxes: Iterable[BoxChoice]) -> list[CargoEntry]:
    """Return boxes by cargo, as text of three digits."""
    grouped: dict[str, list[str | int]] = {}
    for choice in boxes:
        grouped.setdefault(choice.compartment, []).append(f"{choice.box:03}")
    return [CargoEntry(cargo, numbers) for cargo, numbers in grouped.items()]


def reason_of(failure: Failure | None) -> str:
    """Return the reason of a failure: empty without one, a plain sentence where the API has no word."""
    return REASONS.get(failure, failure.value) if failure else ""


def results_of(results: Sequence[PickUp]) -> list[PickupResult]:
    """Return the outcomes of boxes and stops."""
    found = []
    for result in results:
        entry = PickupResult("FAILED" if result.failure else "SUCCEEDED", reason=reason_of(result.failure))
        if result.box:
            entry.cargo_id, entry.box_id = result.box.compartment, str(result.box.box)
        else:
            entry.task_point_id = result.stop
        found.append(entry)
    return found


def name_of(robot: Robot, target: str) -> LocationInfo:
    """Return a place's display name; ``target`` may be its id."""
    places = list(robot[Places].all())
    if Storeys in robot and (maps := robot[Storeys].maps) is not None:
        places += [known.place for known in maps.places()]
    for place in places:
        if target in (place.metadata.get(NAME), place.id):
            return LocationInfo(place.metadata.get(NAME, place.id), place.metadata.get("type", ""))
    return LocationInfo(target)


def task_request_of(robot: Robot, order: Order) -> DeliveryTaskRequest:
    """Return the request in the form of reports."""
    return DeliveryTaskRequest(
        target=name_of(robot, order.request.target).poi_name,
        type=KIND_WORDS.get(order.request.kind, "RETURN"),
        req_id=order.id,
        order_id=order.number,
        no_pickup_wait=order.request.kind in (OrderKind.GUIDE, OrderKind.RETURN),
        cargos=entries_of(order.request.boxes),
        station_id=order.request.stops[0] if order.request.kind is OrderKind.STATION else "",
        failed_tasks=[Untaken(name_of(robot, part.target).poi_name, entries_of(part.boxes)) for part in order.untaken],
    )


def ride_word(action: Action | None) -> str:
    """Return the stage of a lift ride; empty without one."""
    stage = part_of(action).feedback if action else None
    return RIDE_STAGES[stage] if isinstance(stage, RideStage) else ""


def task_of(robot: Robot, order: Order) -> DeliveryTask:
    """Return an order in the API's form; one that has not begun has no stage."""
    stage = "" if order.status is OrderStatus.READY else STAGES[order.stage]
    if order.status is OrderStatus.RUNNING:
        stage = ride_word(next(iter(robot.actions.running(ERRAND)), None)) or stage
    stamp = datetime.fromtimestamp(order.changed_at, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    results = results_of(order.results)
    result = TaskResult(stage=stage, reason=reason_of(order.failure), pickup_result=results, timestamp=stamp)
    return DeliveryTask(order.id, task_request_of(robot, order), order.status.value.upper(), result)


def box_of(state: BoxState) -> Box:
    """Return a box in the API's form."""
    stock = STOCKS[state.stock]
    status = "ERROR" if state.errors else "EMPTY" if state.stock is Stock.EMPTY else "NOT_EMPTY"
    lock = "LOCKED" if state.locked else "UNLOCKED"
    return Box(state.id, DOORS[state.door], lock, stock, status, list(state.errors))


def orientation_and_type(compartment: Compartment) -> tuple[str, str]:
    """Return orientation and type in capitals."""
    return compartment.orientation.upper(), compartment.kind.upper()
