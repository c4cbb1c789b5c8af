"""Follow-up of failed orders: notifies people, and returns uncollected parcels to the reception."""

from __future__ import annotations

from dataclasses import replace

from roboglot.autonomy.delivery.drive import DeliveryDrive
from roboglot.autonomy.delivery.order_book import OrderBook
from roboglot.autonomy.delivery.readiness import Readiness
from roboglot.autonomy.delivery.rules import BOXED, RECEPTION, place_of_type
from roboglot.model.components.logistics.delivery import Failure, Order, OrderKind, OrderRequest, OrderStatus, Untaken
from roboglot.model.events import DeliveryNews
from roboglot.model.robot import Robot


async def follow_up(robot: Robot, book: OrderBook, driver: DeliveryDrive, readiness: Readiness, order: Order) -> None:
    """Report a failed order, and return its parcels to the reception by a COLLECT order."""
    kind = order.request.kind
    if order.failure is Failure.INTERRUPTED:
        readiness.rest_due = False  # another client is driving the robot
    if order.failure is Failure.NOT_LOCALIZED:
        readiness.lose()
    if kind is OrderKind.DISINFECT:
        driver.report(DeliveryNews.DISINFECT_FAILED)
    if order.failure is Failure.NOT_TAKEN:
        driver.report(DeliveryNews.NOT_COLLECTED if kind is OrderKind.COLLECT else DeliveryNews.NOT_TAKEN)
    taken = {result.box for result in order.results if result.failure is None}
    left = tuple(box for box in order.request.boxes if box not in taken)
    reception = place_of_type(robot, RECEPTION)
    if kind in BOXED and left and reception is not None:
        driver.report(DeliveryNews.BACK_TO_RECEPTION)
        await _collect(book, reception.place.id, Untaken(order.request.target, left))


async def _collect(book: OrderBook, reception: str, untaken: Untaken) -> None:
    """Add uncollected boxes to a waiting COLLECT order, or add a new one."""
    waiting = [o for o in book.open if o.request.kind is OrderKind.COLLECT and o.status is OrderStatus.READY]
    if waiting:
        known = waiting[0]
        merged = replace(known.request, boxes=(*known.request.boxes, *untaken.boxes))
        await book.change(known.id, request=merged, untaken=(*known.untaken, untaken))
        return
    (collect,) = await book.add([OrderRequest(OrderKind.COLLECT, reception, boxes=untaken.boxes)])
    await book.change(collect.id, untaken=(untaken,))
