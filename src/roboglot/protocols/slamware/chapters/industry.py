"""Chapter "industry": templates of rounds, and the tasks of call buttons."""

from __future__ import annotations

import math
import uuid
from datetime import UTC, datetime
from typing import Literal

from roboglot.model.components.logistics.delivery import Delivery, Order, OrderKind, OrderStage, OrderStatus
from roboglot.model.components.logistics.industry import Call, CallKind, Industry, Operation, RoundTemplate
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.link import require_heard
from roboglot.model.geometry import Pose
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.delivery.tasks import StatusFilter, is_asked
from roboglot.protocols.slamware.chapters.delivery.vocabulary import name_of, reason_of, ride_word
from roboglot.protocols.slamware.chapters.system.system import device_id
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import pose3d
from roboglot.wire.slamware.chapters.industry import (
    CommonResponse,
    IndustryResult,
    IndustryTarget,
    IndustryTask,
    IndustryTaskRequest,
    LandingPose,
    LandingRequest,
    TaskEvent,
    TaskOperation,
    TaskTemplate,
    TemplateRequest,
)

TASKS = "/api/industry/v1/tasks"
TEMPLATES = f"{TASKS}/templates"
KINDS = {
    CallKind.PLAIN: "CARRY_CALLING",
    CallKind.BY_TEMPLATE: "CARRY_CALLING_BY_TEMPLATE",
}
OWN_MADE = 0  # the only template type shown in the manual
INDUSTRY = "INDUSTRY"
STAGES = {
    OrderStage.DRIVING_TO_STOP: "GOING_TO_TASK_POINT",
    OrderStage.AT_STOP: "ARRIVED_AT_TASK_POINT",
    OrderStage.DRIVING: "GOING_TO_TARGET_POINT",
    OrderStage.AT_TARGET: "ARRIVED_AT_TARGET_POINT",
}


@TABLE.on(f"POST {TEMPLATES}", right=Right.EDIT, needs=(Industry,))
async def create_task_template(context: Context, body: TemplateRequest) -> TaskTemplate:
    """Store a template, replacing one with the same key; 404 for a place that is not on the map."""
    operations = tuple(Operation(entry.display_name, entry.action, entry.wait_time) for entry in body.action_list)
    template = RoundTemplate(body.key or str(uuid.uuid4()), body.name, operations)
    await context.robot[Industry].put_template(template)
    return _template(context, template)


@TABLE.on(f"GET {TEMPLATES}", right=Right.SEE, needs=(Industry,))
def get_task_templates(context: Context) -> list[TaskTemplate]:
    """Return the templates in the order of their creation."""
    return [_template(context, template) for template in context.robot[Industry].templates]


@TABLE.on(f"DELETE {TEMPLATES}/{{key_id}}", right=Right.EDIT, needs=(Industry,))
async def delete_task_template(context: Context, key_id: str) -> CommonResponse:
    """Delete a template; 404 if there is none."""
    await context.robot[Industry].remove_template(key_id)
    return CommonResponse(result=True, msg="", data={})


@TABLE.on(f"GET {TASKS}", right=Right.SEE, needs=(Delivery, Industry, Places))
def get_industry_tasks(
    context: Context,
    type: Literal["carry_calling_by_template", "carry_calling", "industry"] | None = None,
    status: StatusFilter | None = None,
) -> list[IndustryTask]:
    """Return ready and running tasks, oldest first; with ``status`` "all", ended ones, too."""
    calls = [
        _task(context, call)
        for call in context.robot[Industry].calls
        if (type is None or KINDS[call.kind].lower() == type) and is_asked(call.status, status)
    ]
    if type not in (None, "industry"):
        return calls
    orders = [order for order in context.robot[Delivery].orders if order.request.kind is OrderKind.ROUND]
    return calls + [_round(context, order) for order in orders if is_asked(order.status, status)]


@TABLE.on("POST /api/industry/v1/generate_landing_pose", right=Right.SEE, needs=(Localization,))
def generate_landing_pose(context: Context, body: LandingRequest) -> LandingPose:
    """Return the robot's pose, and the pose ahead to approach it from: MoveToTag's target.

    Beyond the manual; real robots place it ``distance`` m straight ahead, headed as the robot or, ``reversed``, back.
    """
    require_heard(context.robot)
    here = context.robot[Localization].pose
    ahead = here.compose(Pose(body.distance, 0.0, math.pi if body.reversed else 0.0))
    return LandingPose(pose3d(ahead), pose3d(here))


@TABLE.on(f"POST {TASKS}/events", right=Right.DRIVE, needs=(Industry,))
async def post_task_event(context: Context, body: TaskEvent) -> None:
    """Report the progress of a call, by the client that carries it out; 404 if unknown, 403 if it has ended."""
    await context.robot[Industry].report(body.task_id, OrderStatus(body.status.lower()))


def _template(context: Context, template: RoundTemplate) -> TaskTemplate:
    """Return a template in the API's form; its scene is the current map."""
    entries = [TaskOperation(o.place, o.action, o.wait_seconds) for o in template.operations]
    device = device_id(context.robot)
    return TaskTemplate(template.key, OWN_MADE, template.name, context.maps.current.map_id, device, entries)


def _task(context: Context, call: Call) -> IndustryTask:
    targets = [IndustryTarget(o.place, o.action, o.wait_seconds) for o in call.operations]
    began = _time(call.began_at) if call.began_at else ""
    target = name_of(context.robot, call.target).poi_name
    request = IndustryTaskRequest(target, KINDS[call.kind], call.number, call.template, began, targets)
    result = IndustryResult(reason=call.reason, timestamp=_time(call.changed_at))
    return IndustryTask(call.id, request, call.status.value.upper(), result)


def _round(context: Context, order: Order) -> IndustryTask:
    """Return a round of the cloud, which the robot carries out by itself; the reason may be that of a failed stop."""
    request = order.request
    points = zip((*request.stops, request.target), request.tasks, request.waits, strict=True)
    targets = [IndustryTarget(place, action, round(wait)) for place, action, wait in points]
    target = name_of(context.robot, request.target).poi_name
    began = _time(order.began_at) if order.began_at else ""
    asked = IndustryTaskRequest(target, INDUSTRY, order.number, "", began, targets)
    stage = ""
    if order.status is OrderStatus.RUNNING:
        stage = ride_word(context.actions.current) or _stage_of(order)
    failure = order.failure or next((result.failure for result in order.results if result.failure), None)
    result = IndustryResult(stage=stage, reason=reason_of(failure), timestamp=_time(order.changed_at))
    return IndustryTask(order.id, asked, order.status.value.upper(), result)


def _stage_of(order: Order) -> str:
    """Return the stage; without a duration the robot waits until a client ends the operation."""
    number = order.request.stops.index(order.stop) if order.stop in order.request.stops else len(order.request.stops)
    standing = order.stage in (OrderStage.AT_STOP, OrderStage.AT_TARGET)
    return "WAIT_OPERATION" if standing and not order.request.waits[number] else STAGES[order.stage]


def _time(epoch: float) -> str:
    return datetime.fromtimestamp(epoch, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
