"""Chapter "industry": templates of rounds, and tasks created from them by call buttons."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from roboglot.wire.slamware.geometry import Pose3D

DISTANCE_MAX = 100.0  # m to a landing point
OPERATIONS_MAX = 100
WAIT_MAX = 86_400  # s
Text = Annotated[str, msgspec.Meta(max_length=256)]


class TaskOperation(msgspec.Struct):
    """Stop at the place ``display_name``: do ``action``, then wait for ``wait_time`` s."""

    display_name: Annotated[str, msgspec.Meta(min_length=1, max_length=256)]
    action: Text = ""
    wait_time: Annotated[int, msgspec.Meta(ge=0, le=WAIT_MAX)] = 0


class TemplateRequest(msgspec.Struct):
    """A template to create; without ``key`` the robot assigns one."""

    name: Text
    action_list: Annotated[list[TaskOperation], msgspec.Meta(max_length=OPERATIONS_MAX)] = []
    key: Annotated[str, msgspec.Meta(max_length=64)] = ""


class TaskTemplate(msgspec.Struct):
    """A stored template."""

    task_template_key: str
    task_template_type: int
    name: str
    scene_id: str
    device_id: str
    action_list: list[TaskOperation]


class CommonResponse(msgspec.Struct):
    """Result of an operation, as JSON; the manual calls it text/plain."""

    result: bool
    msg: str
    data: dict[str, str]


class IndustryTarget(msgspec.Struct):
    """A place of a round."""

    target_name: str
    action: str
    wait_time: int


class IndustryTaskRequest(msgspec.Struct):
    """Request of a call button."""

    target: str
    type: str
    order_id: str
    template_key: str
    start_time: str
    task_targets: list[IndustryTarget]
    message: dict[str, str] = {}


class IndustryResult(msgspec.Struct, omit_defaults=True, kw_only=True):
    """Result of a call, without ``stage`` where the client that carries it out reports only its status."""

    stage: str = ""
    reason: str
    timestamp: str


class IndustryTask(msgspec.Struct):
    """A call and its result."""

    id: str
    task: IndustryTaskRequest
    status: str
    result: IndustryResult


class LandingRequest(msgspec.Struct):
    """Distance ahead of the robot (m); ``reversed``: heading back to it."""

    distance: Annotated[float, msgspec.Meta(ge=-DISTANCE_MAX, le=DISTANCE_MAX)]
    reversed: bool = False


class LandingPose(msgspec.Struct):
    """The landing point and the robot's pose, in the map."""

    landing_pose: Pose3D
    robot_pose: Pose3D


class TaskEvent(msgspec.Struct):
    """Report of the client that runs a task."""

    task_id: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
    status: Literal["RUNNING", "SUCCEEDED", "FAILED"]
