"""Orders of a delivering robot: sentences for pages on tasks, progress and outcome; verbs to resume and cancel."""

from __future__ import annotations

from roboglot.console.verbs.robots import VERBS, Name
from roboglot.model.action import ActionStatus
from roboglot.model.components.logistics.delivery import Delivery, Order, OrderKind, OrderStage, OrderStatus
from roboglot.model.components.system.lease import Lease
from roboglot.model.robot import Robot

OPEN_MAX, ENDED_MAX = 20, 5  # shown
STATUSES = {  # pages know the words of actions
    OrderStatus.READY: "waiting",
    OrderStatus.RUNNING: ActionStatus.EXECUTING.name,
    OrderStatus.CANCELING: ActionStatus.CANCELING.name,
    OrderStatus.SUCCEEDED: ActionStatus.SUCCEEDED.name,
    OrderStatus.FAILED: ActionStatus.ABORTED.name,
    OrderStatus.CANCELED: ActionStatus.CANCELED.name,
}


@VERBS.on("resume_orders", needs=(Delivery,))
async def resume_orders(robot: Robot) -> None:
    """Go on with the orders, and with scheduled programs, after a stop."""
    await robot[Delivery].execute(True)
    if Lease in robot:
        robot[Lease].stopped = ""


@VERBS.on("cancel_order", needs=(Delivery,))
async def cancel_order(robot: Robot, *, order: Name) -> None:
    """Cancel an order; the robot brakes."""
    await robot[Delivery].cancel(order)


def orders_of(robot: Robot) -> dict[str, object] | None:
    """Return the orders in turn, then the last ended ones, the hold and the number of orders left out, if any."""
    if Delivery not in robot:
        return None
    delivery = robot[Delivery]
    known = [*delivery.orders]
    upcoming = [order for order in known if not order.status.ended]
    shown = upcoming[:OPEN_MAX] + [order for order in reversed(known) if order.status.ended][:ENDED_MAX]
    words = "The orders wait: the robot was stopped, or someone uses its screen."
    return {
        "held": "" if delivery.executing else words,
        "more": len(upcoming[OPEN_MAX:]),
        "list": [_order(order) for order in shown],
    }


def _order(order: Order) -> dict[str, object]:
    running = order.status is OrderStatus.RUNNING
    return {
        "id": order.id,
        "task": _task(order),
        "status": STATUSES[order.status],
        "open": not order.status.ended,
        "doing": _doing(order) if running else "",
        "client": order.client,
        "reason": order.failure or "",
    }


def _task(order: Order) -> str:
    target = order.request.target
    match order.request.kind:
        case OrderKind.FOOD:
            words = f"serve food at {target}"
        case OrderKind.RECYCLE:
            words = f"collect dishes at {target}"
        case OrderKind.GUIDE:
            words = f"guide someone to {target}"
        case OrderKind.RETURN:
            words = f"return to {target}"
        case OrderKind.ROUND:
            words = f"make a round that ends at {target}"
        case OrderKind.DISINFECT:
            words = f"disinfect {target}"
        case OrderKind.COLLECT:
            words = f"bring what was not taken to {target}"
        case _:
            words = f"carry things to {target}"
    return words


def _doing(order: Order) -> str:
    stop, target = order.stop, order.request.target
    match order.stage:
        case OrderStage.DRIVING_TO_STOP:
            words = f"on the way to {stop}"
        case OrderStage.AT_STOP:
            words = f"waits at {stop} until the work there is done"
        case OrderStage.DRIVING:
            words = f"on the way to {target}"
        case OrderStage.AT_TARGET:
            words = f"waits for people at {target}"
        case OrderStage.DRIVING_TO_CABINET:
            words = "on the way to the cabinet"
        case OrderStage.AT_CABINET:
            words = "waits until the cabinet has filled the boxes"
        case OrderStage.HANDING_OVER:
            words = "someone is at the boxes"
    return words
