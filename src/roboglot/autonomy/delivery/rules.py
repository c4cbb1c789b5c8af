"""The rules of the delivery service: places by name, working hours, acceptable orders. Pure decisions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime

from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.delivery import BoxChoice, Order, OrderKind, OrderRequest, Policy, WorkMode
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.mapping.storeys import StoreyPlace, Storeys
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.robot import Robot

NAME, TYPE = "display_name", "type"  # metadata that users set on places
RECEPTION, PARKING = "RECEPTION", "PARKING"
STOPS_MAX, BOXES_MAX = 50, 50
BOXED = (OrderKind.TAKEOUT, OrderKind.DISTRIBUTE, OrderKind.STATION)


def known_places(robot: Robot) -> Iterator[StoreyPlace]:
    """Yield the places of this floor (""), then those of all others."""
    for place in robot[Places].all():
        yield StoreyPlace("", place)
    if Storeys in robot and (maps := robot[Storeys].maps) is not None:
        yield from maps.places()


def place_named(robot: Robot, name: str) -> StoreyPlace:
    """Return the place with this display name or id. Raises NotFound."""
    for known in known_places(robot):
        if name in (known.place.metadata.get(NAME), known.place.id):
            return known
    raise NotFound(f"there is no place {name!r}")


def place_of_type(robot: Robot, kind: str) -> StoreyPlace | None:
    """Return the first place of this type, preferably on this floor; None: there is none."""
    return next((known for known in known_places(robot) if known.place.metadata.get(TYPE) == kind), None)


def at_work(policy: Policy, epoch: float) -> bool:
    """True if ``epoch`` (s since 1970) is within working hours; days and hours are in UTC."""
    now = datetime.fromtimestamp(epoch, UTC)
    if now.isoweekday() % 7 in policy.rest_days:
        return False
    second = now.hour * 3600 + now.minute * 60 + now.second
    # Hours that end before they begin run past midnight.
    return not policy.hours or any(
        begin <= second < end if begin <= end else second >= begin or second < end for begin, end in policy.hours
    )


def check_requests(
    robot: Robot, policy: Policy, requests: Sequence[OrderRequest], open_orders: Iterable[Order]
) -> None:
    """Raise Refused, NotFound or InvalidGoal if any of the requests cannot be accepted."""
    taken = {box: order.number for order in open_orders for box in order.request.boxes}
    for request in requests:
        _check_mode(policy.work_mode, request)
        _check_stops(robot, request)
        for box in request.boxes:
            _check_box(robot, box)
            if box in taken:
                raise Refused(f"box {box.box} belongs to order {taken[box]}")
            taken[box] = request.target


def _check_mode(mode: WorkMode, request: OrderRequest) -> None:
    if request.remote:
        return
    if mode is WorkMode.DISPATCH:
        raise Refused("in this work mode only remote orders are accepted")
    if mode is WorkMode.RECYCLE and request.kind is not OrderKind.RECYCLE:
        raise Refused("in this work mode the robot only collects dishes")


def _check_stops(robot: Robot, request: OrderRequest) -> None:
    if len(request.stops) > STOPS_MAX or len(request.boxes) > BOXES_MAX:
        raise InvalidGoal(f"at most {STOPS_MAX} stops and {BOXES_MAX} boxes")
    for name in (*request.stops, request.target):
        place_named(robot, name)
    if request.kind in (OrderKind.TAKEOUT, OrderKind.STATION) and not request.boxes:
        raise InvalidGoal("a takeout needs a box")
    if request.kind is OrderKind.STATION and not request.stops:
        raise InvalidGoal("the first stop is the cabinet")


def _check_box(robot: Robot, choice: BoxChoice) -> None:
    compartments = [c for c in robot[Cargo].compartments if c.id == choice.compartment]
    if not compartments or choice.box not in compartments[0].boxes:
        raise NotFound(f"there is no box {choice.box} in {choice.compartment!r}")
