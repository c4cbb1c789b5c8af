"""Chapter "industry": templates of rounds and the tasks that call buttons make of them."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from roboglot.wire.slamware.geometry import Pose3D

DISTANCE_MAX = 100.0  # m to a landing point
OPERATIONS_MAX = 100
WAIT_MAX = 86_400  # s
Text = Annotated[str, msgspec.Meta(max_length=256)]


class TaskOperation(msgspec.Struct):
    """Stop at the place of that display name: do ``action``, then wait (s)."""

    display_name: Annotated[str, msgspec.Meta(min_length=1, max_length=256)]
    action: Text = ""
    wait_time: Annotated[int, msgspec.Meta(ge=0, le=WAIT_MAX)] = 0


class TemplateRequest(msgspec.Struct):
    """A template to make; without ``key`` the robot makes one."""

    name: Text
    action_list: Annotated[list[TaskOperation], msgspec.Meta(max_length=OPERATIONS_MAX)] = []
    key: Annotated[str, msgspec.Meta(max_length=64)] = ""


class TaskTemplate(msgspec.Struct):
    """A template as it is kept."""

    task_template_key: str
    task_template_type: int
    name: str
    scene_id: str
    device_id: str
    action_list: list[TaskOperation]


class CommonResponse(msgspec.Struct):
    """The manual calls it text/plain; clients read JSON."""

    result: bool
    msg: str
    data: dict[str, str]


class IndustryTarget(msgspec.Struct):
    """A place of a round."""

    target_name: str
    action: str
    wait_time: int


class IndustryTaskRequest(msgspec.Struct):
    """Kind of call."""

    target: str
    type: str
    order_id: str
    template_key: str
    start_time: str
    task_targets: list[IndustryTarget]
    message: dict[str, str] = {}


class IndustryResult(msgspec.Struct):
    """``stage`` is empty for calls: the client that carries them out reports no more than their status."""

    stage: str
    reason: str
    timestamp: str


class IndustryTask(msgspec.Struct):
    """A call and what became of it."""

    id: str
    task: IndustryTaskRequest
    status: str
    result: IndustryResult


class LandingRequest(msgspec.Struct):
    """Distance ahead (m) of the robot, and whether headed back to it."""

    distance: Annotated[float, msgspec.Meta(ge=-DISTANCE_MAX, le=DISTANCE_MAX)]
    reversed: bool = False


class LandingPose(msgspec.Struct):
    """The landing point and where the robot is, in the map."""

    landing_pose: Pose3D
    robot_pose: Pose3D


class TaskEvent(msgspec.Struct):
    """Report of the client that runs a task."""

    task_id: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
    status: Literal["RUNNING", "SUCCEEDED", "FAILED"]
