"""Chapter "delivery": tasks, and input of people at the robot during them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import msgspec

from roboglot.model.components.logistics.delivery import Delivery, Order, OrderRequest, OrderStatus
from roboglot.model.components.mapping.places import Places
from roboglot.model.errors import ComponentMissing, RobotError
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.delivery.vocabulary import KIND_WORDS, NO_TASKS, request_of, task_of
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import NO_CONTENT, TABLE, NoContent
from roboglot.wire.slamware.chapters.delivery import (
    DeliveryTask,
    TaskCreated,
    TaskError,
    TaskExecution,
    TaskRequest,
    TasksCreated,
)

TASKS = "/api/delivery/v1/tasks"
BATCH_MAX = 100
KindFilter = Literal["takeout", "retail", "collect", "refill", "food_delivery", "recycle", "return", "call", "guide"]
StatusFilter = Literal["ready", "running", "succeeded", "failed", "all"]


@TABLE.on(f"GET {TASKS}", right=Right.SEE, needs=(Delivery, Places))
def get_tasks(
    context: Context, type: KindFilter | None = None, status: StatusFilter | None = None
) -> list[DeliveryTask]:
    """Return ready and running tasks, oldest first; with ``status`` "all", ended ones, too."""
    return [
        task_of(context.robot, order)
        for order in context.robot[Delivery].orders
        if order.request.kind not in NO_TASKS
        and (type is None or KIND_WORDS[order.request.kind].lower() == type)
        and is_asked(order.status, status)
    ]


def is_asked(status: OrderStatus, asked: StatusFilter | None) -> bool:
    """Return whether a query by status selects a task; without a status, those that have not ended."""
    match asked:
        case None:
            return not status.ended
        case "all":
            return True
        case "running":
            return status in (OrderStatus.RUNNING, OrderStatus.CANCELING)
        case _:
            return status.value == asked


@TABLE.on(f"POST {TASKS}", right=Right.DRIVE, needs=(Delivery,))
async def create_task(context: Context, body: TaskRequest) -> TaskCreated:
    """Queue a task; a refusal is an answer with ``result`` false."""
    orders, errors = await _accept(context, [request_of(body)])
    return TaskCreated(bool(orders), orders[0].number if orders else "", errors)


@TABLE.on(f"POST {TASKS}/:batch", right=Right.DRIVE, needs=(Delivery,))
async def create_tasks(
    context: Context, body: Annotated[list[TaskRequest], msgspec.Meta(min_length=1, max_length=BATCH_MAX)]
) -> TasksCreated:
    """Queue several tasks, all or none."""
    orders, errors = await _accept(context, [request_of(entry) for entry in body])
    return TasksCreated(bool(orders), [order.number for order in orders], errors)


async def _accept(context: Context, requests: list[OrderRequest]) -> tuple[Sequence[Order], list[TaskError]]:
    try:
        return await context.robot[Delivery].accept(*requests), []
    except ComponentMissing:
        raise
    except RobotError as error:
        return (), [TaskError(str(error))]


@TABLE.on(f"DELETE {TASKS}", right=Right.DRIVE, needs=(Delivery,))
async def cancel_all_tasks(context: Context) -> None:
    """Cancel all tasks; the robot brakes and goes to rest."""
    await context.robot[Delivery].cancel()


@TABLE.on(f"DELETE {TASKS}/{{task_id}}", right=Right.DRIVE, needs=(Delivery,))
async def cancel_task_by_task_id(context: Context, task_id: str) -> None:
    """Cancel a task; 404 if there is none."""
    await context.robot[Delivery].cancel(task_id)


@TABLE.on(f"DELETE {TASKS}/orders/{{order_id}}", right=Right.DRIVE, needs=(Delivery,))
async def cancel_task_by_order_id(context: Context, order_id: str) -> None:
    """Cancel a task by the order number that its creation returned."""
    await context.robot[Delivery].cancel(order_id)


@TABLE.on(f"PUT {TASKS}/:task_execution", right=Right.DRIVE, needs=(Delivery,))
async def set_task_execution(context: Context, body: TaskExecution | None = None) -> TaskExecution:
    """Hold the robot while people use its screen (false), or let it continue, or rest without a task (true).

    Without a body nothing changes; the answer is how it is.
    """
    delivery = context.robot[Delivery]
    if body is not None:
        await delivery.execute(body.enable_task_execution)
    return TaskExecution(delivery.executing)


@TABLE.on(f"PUT {TASKS}/:task_finish", right=Right.DRIVE, needs=(Delivery,))
async def end_task(context: Context) -> NoContent:
    """End all tasks as succeeded."""
    await context.robot[Delivery].finish()
    return NO_CONTENT


@TABLE.on(f"PUT {TASKS}/:start_pickup", right=Right.DRIVE, needs=(Delivery,))
async def start_pickup(context: Context) -> NoContent:
    """Begin to take goods out; 403 unless the robot stands at the target."""
    await context.robot[Delivery].start_pickup()
    return NO_CONTENT


@TABLE.on(f"PUT {TASKS}/:end_pickup", right=Right.DRIVE, needs=(Delivery,))
async def end_pickup(context: Context) -> NoContent:
    """Finish a box: its door closes, and the next one opens. 403 unless goods are being taken out."""
    await context.robot[Delivery].end_pickup()
    return NO_CONTENT


@TABLE.on(f"PUT {TASKS}/:end_operation", right=Right.DRIVE, needs=(Delivery,))
async def end_operation(context: Context) -> NoContent:
    """Let the task leave this point; 403 unless the robot stands at one."""
    await context.robot[Delivery].end_operation()
    return NO_CONTENT
