"""Chapter "delivery": the current stage of the service, with its details."""

from __future__ import annotations

from roboglot.model.actions import Action
from roboglot.model.components.logistics.delivery import Delivery, Order, OrderStage, Phase
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.health import Health
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.delivery.vocabulary import (
    STAGES,
    name_of,
    results_of,
    ride_word,
    task_of,
    task_request_of,
)
from roboglot.protocols.slamware.chapters.system.fault_numbers import is_error, record_of
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.delivery import DeviceError, Pickup, StageInfo, TaskStage

LANDING = {None: "INITIALIZING", "approaching": "GOING_TO_LANDING_POINT"}  # by the feedback of docking


@TABLE.on("GET /api/delivery/v1/stage", right=Right.SEE, needs=(Delivery, Places))
def get_stage(context: Context) -> TaskStage:
    """Return the stage: a fault that stops the robot comes before the task, and that before the way to rest."""
    delivery, floor = context.robot[Delivery], context.maps.current.floor
    if errors := _errors(context):
        return TaskStage("DEVICE_ERROR", info=StageInfo(errors=errors))
    if (order := delivery.current) is not None:
        return _of_order(context, order, floor)
    action = context.actions.current
    match delivery.phase:
        case Phase.RETURNING:
            return TaskStage("ON_RETURNING", current_floor=floor, target_floor=_bound_for(action) or floor)
        case Phase.GOING_HOME:
            word = action.feedback if action and isinstance(action.feedback, str) else None
            milestone = ride_word(action) or LANDING.get(word, "GOING_HOME")
            return TaskStage("GOING_HOME", milestone, floor, _bound_for(action) or floor)
        case _:
            return TaskStage("IDLE", current_floor=floor)


def _bound_for(action: Action | None) -> str:
    """Return the floor that the robot rides to; empty without a ride."""
    return action.goal.rpartition("/")[2] if action and ride_word(action) and isinstance(action.goal, str) else ""


def _of_order(context: Context, order: Order, floor: str) -> TaskStage:
    task, action = task_request_of(context.robot, order), context.actions.current
    there = _bound_for(action) or floor
    match order.stage:
        case OrderStage.DRIVING_TO_STOP:
            return TaskStage(STAGES[order.stage], ride_word(action), floor, there, StageInfo(task=task))
        case OrderStage.AT_STOP:
            return TaskStage(
                STAGES[order.stage], info=StageInfo(task=task, location=name_of(context.robot, order.stop))
            )
        case OrderStage.DRIVING | OrderStage.DRIVING_TO_CABINET | OrderStage.AT_CABINET:
            goal = order.request.target if order.stage is OrderStage.DRIVING else order.stop
            info = StageInfo(task=task, location=name_of(context.robot, goal))
            return TaskStage("ON_DELIVERING", ride_word(action) or STAGES[order.stage], floor, there, info)
        case _:
            boxes = [result for result in order.results if result.box]
            pickup = Pickup(len(order.request.boxes), sum(not r.failure for r in boxes), results_of(boxes))
            whole = task_of(context.robot, order)
            info = StageInfo(whole.id, whole.status, whole.result, task)
            return TaskStage("ARRIVED_AT_TARGET", info=info, pickup=pickup)


def _errors(context: Context) -> list[DeviceError]:
    if Health not in context.robot:
        return []
    now = context.robot.clock.time()
    records = [record_of(fault) for fault in context.robot[Health].faults if is_error(fault, now)]
    return [DeviceError(r.component, r.error_code, r.level, r.message) for r in records]
