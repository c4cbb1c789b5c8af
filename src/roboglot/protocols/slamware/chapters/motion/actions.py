"""Chapter "motion": create, watch and abort actions; path, milestones, speed, time."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.link import require_heard
from roboglot.model.errors import Unreachable
from roboglot.model.geometry import Point
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.action_factories import FACTORIES, create
from roboglot.protocols.slamware.chapters.motion.errands import part_of
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.motion import (
    ActionFactory,
    ActionGravestone,
    ActionInfo,
    ActionRequest,
    PathPoints,
    PathQuery,
    Speed,
)

API = "/api/core/motion/v1"
SEARCH_SECONDS = 10.0  # the longest search when the client sets no limit


@TABLE.on(f"GET {API}/action-factories", right=Right.SEE)
async def get_action_factories(context: Context) -> list[ActionFactory]:
    """The kinds of action that this robot can do."""
    return [
        ActionFactory(context.actions.prefix + word)
        for word, factory in FACTORIES.items()
        if all(component in context.robot for component in factory.needs)
    ]


@TABLE.on(f"POST {API}/actions", right=Right.DRIVE)
async def create_action(context: Context, body: ActionRequest) -> ActionInfo:
    """Start an action in place of the one under way; 400 for what this robot cannot do or does not understand."""
    return context.actions.enter(body.action_name, create(context, body))


@TABLE.on(f"GET {API}/actions/:current", right=Right.SEE)
async def get_current_action(context: Context) -> ActionInfo:
    """What the robot does; 404 when it does nothing."""
    return context.actions.current_info()


@TABLE.on(f"DELETE {API}/actions/:current", right=Right.DRIVE)
async def abort_current_action(context: Context) -> None:
    """Stop, no matter who asked for the motion; fine when nothing moves."""
    context.actions.abort()


@TABLE.on(f"GET {API}/actions/{{action_id}}", right=Right.SEE)
async def get_action_result(context: Context, action_id: int) -> ActionInfo | ActionGravestone:
    """One under way, or what is left of one of the last 20; 404 otherwise."""
    return context.actions.look_up(action_id)


@TABLE.on(f"GET {API}/path", right=Right.SEE)
async def get_remaining_path(context: Context) -> PathPoints:
    """What is left to drive; empty when the robot goes nowhere."""
    feedback = _navigation(context)
    return _path_points(feedback.remaining.points if feedback else ())


@TABLE.on(f"GET {API}/milestones", right=Right.SEE)
async def get_remaining_milestones(context: Context) -> PathPoints:
    """The goals still to reach."""
    feedback = _navigation(context)
    return _path_points(feedback.milestones if feedback else ())


@TABLE.on(f"GET {API}/speed", right=Right.SEE, needs=(Odometry,))
async def get_current_speed(context: Context) -> Speed:
    """How the robot moves, by its odometry."""
    require_heard(context.robot)
    twist = context.robot[Odometry].reading.twist
    return Speed(twist.x, twist.y, twist.yaw)


@TABLE.on(f"GET {API}/time", right=Right.SEE)
async def get_remaining_time(context: Context) -> float:
    """Seconds to the goal; 0 when the robot goes nowhere."""
    feedback = _navigation(context)
    return feedback.time_to_goal if feedback else 0.0


@TABLE.on(f"POST {API}/:search_path", right=Right.SEE, needs=(Localization, Navigation))
async def search_path(context: Context, body: PathQuery) -> PathPoints:
    """The path that the robot would take to a target, without going; empty if there is none."""
    robot = context.robot
    plan = robot[Navigation].plan(robot[Localization].pose.point, Point(body.target.x, body.target.y))
    try:
        path = await robot.clock.wait_for(plan, body.timeout / 1000 or SEARCH_SECONDS)
    except (Unreachable, TimeoutError):
        return PathPoints([])
    return _path_points(path.points)


def _navigation(context: Context) -> NavigationFeedback | None:
    feedback = part_of(action).feedback if (action := context.actions.current) else None
    return feedback if isinstance(feedback, NavigationFeedback) else None


def _path_points(points: Sequence[Point]) -> PathPoints:
    return PathPoints([(point.x, point.y) for point in points])
