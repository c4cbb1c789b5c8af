"""Chapter "industry": templates of rounds, and the tasks of call buttons."""

from __future__ import annotations

import uuid
from datetime import UTC, datetime
from typing import Literal

from roboglot.model.components.delivery import OrderStatus
from roboglot.model.components.industry import Call, CallKind, Industry, Operation, RoundTemplate
from roboglot.protocols.slamware.delivery_tasks import StatusFilter, is_asked
from roboglot.protocols.slamware.delivery_vocabulary import name_of
from roboglot.protocols.slamware.operations import OPERATIONS, Desk
from roboglot.protocols.slamware.system import device_id
from roboglot.wire.slamware.industry import (
    CommonResponse,
    IndustryResult,
    IndustryTarget,
    IndustryTask,
    IndustryTaskRequest,
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
OWN_MADE = 0  # the only template type that the manual shows
NO_ROUNDS = "tasks of kind industry, which the cloud gives, do not exist: no cloud manages this robot"


@OPERATIONS.on(f"POST {TEMPLATES}")
async def create_task_template(desk: Desk, body: TemplateRequest) -> TaskTemplate:
    """Keep it, in place of one with the same key; 404 for a place that is not on the map."""
    operations = tuple(Operation(entry.display_name, entry.action, entry.wait_time) for entry in body.action_list)
    template = RoundTemplate(body.key or str(uuid.uuid4()), body.name, operations)
    await desk.robot[Industry].put_template(template)
    return _template(desk, template)


@OPERATIONS.on(f"GET {TEMPLATES}")
async def get_task_templates(desk: Desk) -> list[TaskTemplate]:
    """In the order in which they were made."""
    return [_template(desk, template) for template in desk.robot[Industry].templates]


@OPERATIONS.on(f"DELETE {TEMPLATES}/{{key_id}}")
async def delete_task_template(desk: Desk, key_id: str) -> CommonResponse:
    """Forget it; 404 if there is none."""
    await desk.robot[Industry].remove_template(key_id)
    return CommonResponse(result=True, msg="", data={})


@OPERATIONS.on(f"GET {TASKS}", partial=NO_ROUNDS)
async def get_industry_tasks(
    desk: Desk,
    type: Literal["carry_calling_by_template", "carry_calling", "industry"] | None = None,
    status: StatusFilter | None = None,
) -> list[IndustryTask]:
    """Those ready and running, oldest first; with ``status`` all also those that ended."""
    return [
        _task(desk, call)
        for call in desk.robot[Industry].calls
        if (type is None or KINDS[call.kind].lower() == type) and is_asked(call.status, status)
    ]


@OPERATIONS.on(f"POST {TASKS}/events")
async def post_task_event(desk: Desk, body: TaskEvent) -> None:
    """The client that carries out a call says how it goes; 404 for an unknown one, 403 for one that has ended."""
    await desk.robot[Industry].report(body.task_id, OrderStatus(body.status.lower()))


def _template(desk: Desk, template: RoundTemplate) -> TaskTemplate:
    """The scene is the map in use."""
    entries = [TaskOperation(o.place, o.action, o.wait_seconds) for o in template.operations]
    device = device_id(desk.robot.description.serial)
    return TaskTemplate(template.key, OWN_MADE, template.name, desk.maps.current.map_id, device, entries)


def _task(desk: Desk, call: Call) -> IndustryTask:
    targets = [IndustryTarget(o.place, o.action, o.wait_seconds) for o in call.operations]
    began = _time(call.began_at) if call.began_at else ""
    target = name_of(desk.robot, call.target).poi_name
    request = IndustryTaskRequest(target, KINDS[call.kind], call.number, call.template, began, targets)
    result = IndustryResult("", call.reason, _time(call.changed_at))
    return IndustryTask(call.id, request, call.status.value.upper(), result)


def _time(epoch: float) -> str:
    return datetime.fromtimestamp(epoch, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
