"""Plans, tried in a copy of the world before the robot carries them out, for scripts and agents."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from roboglot.console.desk import CLIENT, Desk
from roboglot.console.verbs.robots import Meters, Moment, Speed
from roboglot.model.admission import Right
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.errors import Busy, NotFound
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.programs.rehearsing import Step, Tried

STEPS_MAX = 20
PATH_MAX = 200  # points per answer


class GoTo(msgspec.Struct, tag="go_to", tag_field="do", forbid_unknown_fields=True):
    """Drive to a point of the robot's map."""

    x: Meters
    y: Meters


class Drive(msgspec.Struct, tag="drive", tag_field="do", forbid_unknown_fields=True):
    """Drive with a velocity, then brake."""

    x: Speed = 0.0
    y: Speed = 0.0
    yaw: Speed = 0.0
    seconds: Moment = 1.0


class Plan(msgspec.Struct, forbid_unknown_fields=True):
    """Plan to try."""

    steps: Annotated[list[GoTo | Drive], msgspec.Meta(min_length=1, max_length=STEPS_MAX)]


def admitted(desk: Desk, name: str) -> Robot:
    """Return the robot if the current client may try plans for it now. Raises NotFound, Forbidden."""
    robot = desk.view(name, "rehearse").robot
    robot.admission.check(CLIENT, "rehearse", Right.DRIVE)
    return robot


async def rehearse(desk: Desk, name: str, plan: Plan) -> dict[str, object]:
    """Try a plan from where the robot is now; it does not move. Raises NotFound, Forbidden, Busy, ValueError."""
    robot = admitted(desk, name)
    studio = desk.studio
    if studio.rehearse is None or studio.scene_of is None:
        raise NotFound("there is no simulation here to try it in")
    here = robot[Localization].pose
    scene = studio.scene_of(name)
    try:
        tried = await studio.rehearse.try_plan([_step(step, here) for step in plan.steps], scene)
    except RuntimeError as error:
        raise Busy(str(error)) from None
    true = scene.start or here
    return _answer(tried, lambda x, y: here.compose(Pose(x, y).relative_to(true)), plan)


def _step(step: GoTo | Drive, here: Pose) -> Step:
    if isinstance(step, Drive):
        return Step(twist=Twist(step.x, step.y, step.yaw), seconds=step.seconds)
    goal = Pose(step.x, step.y).relative_to(here)
    return Step(goal=Point(goal.x, goal.y))


def _answer(tried: Tried, in_map: Any, plan: Plan) -> dict[str, Any]:
    """Return the result, in the robot's map."""
    stride = max(1, len(tried.path) // PATH_MAX)
    ended = [{"status": status, "reason": why} for status, why in tried.steps]

    def spot(x: float, y: float) -> list[float]:
        pose = in_map(x, y)
        return [round(pose.x, 3), round(pose.y, 3)]

    done = len(ended) == len(plan.steps) and all(step["status"] == "SUCCEEDED" for step in ended)
    return {
        "safe": done and not tried.hits,
        "steps": ended,
        "hits": [{"at": hit.at, "point": spot(hit.x, hit.y), "what": hit.what} for hit in tried.hits],
        "path": [spot(each.x, each.y) for each in [*tried.path[::stride], *tried.path[-1:]]],
        "seconds": tried.seconds,
        "late": tried.late,
    }
