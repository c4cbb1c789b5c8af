"""Chapter "motion": create, watch and abort actions; path, milestones, speed, time; the kinds of action by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback
from roboglot.model.components.motion.sweeping import Sweeping
from roboglot.model.components.motion.tag_docking import TagDocking
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.lease import ERRAND
from roboglot.model.components.system.link import require_current
from roboglot.model.errors import InvalidGoal, RobotError, Unreachable
from roboglot.model.geometry import Point
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion import homing, jacking, lift_rides, moves, relocalizing, tags
from roboglot.protocols.slamware.chapters.motion.errands import part_of
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import BAD_REQUESTS, HttpError
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import PREFIXES, action_word
from roboglot.spelling import meant
from roboglot.validation import why_invalid
from roboglot.values import dataclass
from roboglot.wire.slamware.chapters import motion as wire
from roboglot.wire.slamware.chapters.motion import (
    ActionFactory,
    ActionGravestone,
    ActionInfo,
    ActionRequest,
    PathPoints,
    PathQuery,
    Speed,
)

API = "/api/core/motion/v1"
SEARCH_SECONDS = 10.0  # s: the longest search unless the client sets a limit


@dataclass(frozen=True, slots=True)
class Factory:
    """One kind of action: its options, how to start it, and the components that it takes."""

    options: type[msgspec.Struct]
    start: Callable[[Context, Any], Action]
    needs: tuple[type[Component], ...]


FACTORIES: dict[str, Factory] = {
    "MoveToAction": Factory(wire.MoveToOptions, moves.move_to, (Navigation,)),
    "SeriesMoveToAction": Factory(wire.SeriesMoveToOptions, moves.series_move_to, (Navigation,)),
    "MoveByAction": Factory(wire.MoveByOptions, moves.move_by, (Driving, Base)),
    "RotateAction": Factory(wire.AngleOptions, moves.rotate, (Driving,)),
    "RotateToAction": Factory(wire.AngleOptions, moves.rotate_to, (Driving, Localization)),
    "GoHomeAction": Factory(wire.GoHomeOptions, homing.go_home, (Docking, Navigation)),
    "FollowPathPointsAction": Factory(wire.FollowPathPointsOptions, moves.follow_path_points, (Navigation,)),
    "SweepAction": Factory(wire.SweepOptions, moves.sweep, (Sweeping,)),
    "RecoverLocalizationAction": Factory(
        wire.RecoverLocalizationOptions, relocalizing.recover_localization, (Localization,)
    ),
    "ManualRelocalizationAction": Factory(wire.NoOptions, relocalizing.manual_relocalization, (Localization,)),
    "ReturnToParkingAction": Factory(wire.ReturnToParkingOptions, homing.return_to_parking, (Navigation,)),
    "MultiFloorMoveAction": Factory(wire.MultiFloorMoveOptions, lift_rides.multi_floor_move, (Navigation,)),
    "MultiFloorBackHomeAction": Factory(wire.GoHomeOptions, lift_rides.multi_floor_back_home, (Docking, Navigation)),
    "EnterElevatorAction": Factory(wire.EnterElevatorOptions, lift_rides.enter_elevator, (Navigation, Driving)),
    "LeaveElevatorAction": Factory(wire.LeaveElevatorOptions, lift_rides.leave_elevator, (Navigation,)),
    "MoveToTagAction": Factory(wire.MoveToTagOptions, tags.move_to_tag, (TagDocking,)),
    "SchedulableMoveToTagAction": Factory(wire.ScheduledMoveToTagOptions, tags.scheduled_move_to_tag, (TagDocking,)),
    "BackOffFromTagAction": Factory(wire.BackOffFromTagOptions, tags.back_off_from_tag, (TagDocking,)),
    "JackMoveAction": Factory(wire.JackMoveOptions, jacking.move_jack, (Jack,)),
    "JackTopMoveToAction": Factory(wire.JackTopMoveToOptions, jacking.carry, (Jack, Navigation)),
}


@TABLE.on(f"GET {API}/action-factories", right=Right.SEE)
def get_action_factories(context: Context) -> list[ActionFactory]:
    """Return the kinds of action that this robot can do."""
    return [
        ActionFactory(context.actions.prefix + word)
        for word, factory in FACTORIES.items()
        if all(component in context.robot for component in factory.needs)
    ]


@TABLE.on(f"POST {API}/actions", right=Right.DRIVE)
def create_action(context: Context, body: ActionRequest) -> ActionInfo:
    """Start an action in place of the current one; 400 for unknown or unsupported ones."""
    return context.actions.enter(body.action_name, create(context, body))


@TABLE.on(f"GET {API}/actions/:current", right=Right.SEE)
def get_current_action(context: Context) -> ActionInfo:
    """Return the running action; 404 when there is none."""
    return context.actions.current_info()


@TABLE.on(f"DELETE {API}/actions/:current", right=Right.DRIVE)
def abort_current_action(context: Context) -> None:
    """Stop the robot, no matter which client moves it; no effect at rest."""
    context.actions.abort()


@TABLE.on(f"GET {API}/actions/{{action_id}}", right=Right.SEE)
def get_action_result(context: Context, action_id: int) -> ActionInfo | ActionGravestone:
    """Return an action under way, or the result of one of the last 20; 404 otherwise."""
    return context.actions.look_up(action_id)


@TABLE.on(f"GET {API}/path", right=Right.SEE)
def get_remaining_path(context: Context) -> PathPoints:
    """Return the remaining path; empty when the robot has no goal."""
    feedback = _navigation(context)
    return _path_points(feedback.remaining.points if feedback else ())


@TABLE.on(f"GET {API}/milestones", right=Right.SEE)
def get_remaining_milestones(context: Context) -> PathPoints:
    """Return the goals that remain."""
    feedback = _navigation(context)
    return _path_points(feedback.milestones if feedback else ())


@TABLE.on(f"GET {API}/speed", right=Right.SEE, needs=(Odometry,))
def get_current_speed(context: Context) -> Speed:
    """Return the robot's velocity by its odometry."""
    require_current(context.robot)
    twist = context.robot[Odometry].reading.twist
    return Speed(twist.x, twist.y, twist.yaw)


@TABLE.on(f"GET {API}/time", right=Right.SEE)
def get_remaining_time(context: Context) -> float:
    """Return the seconds to the goal; 0 without one."""
    feedback = _navigation(context)
    return feedback.time_to_goal if feedback else 0.0


@TABLE.on(f"POST {API}/:search_path", right=Right.SEE, needs=(Localization, Navigation))
async def search_path(context: Context, body: PathQuery) -> PathPoints:
    """Plan the path to a target without driving; empty if there is none."""
    robot = context.robot
    plan = robot[Navigation].plan(robot[Localization].pose.point, Point(body.target.x, body.target.y))
    try:
        path = await robot.clock.wait_for(plan, body.timeout / 1000 or SEARCH_SECONDS)
    except (Unreachable, TimeoutError):
        return PathPoints([])
    return _path_points(path.points)


def create(context: Context, request: ActionRequest) -> Action:
    """Start an action in place of the current one. Raises HttpError 400 for a refusal."""
    running = context.robot.actions.running
    before = [*running(ERRAND), *running(BASE)]  # an errand takes the base only when it first drives
    factory = FACTORIES.get(action_word(request.action_name) or "")
    try:
        if factory is None:
            raise InvalidGoal(f"this robot does not know {request.action_name}{_meant(request.action_name)}")
        options = msgspec.convert(request.options or {}, factory.options)
        action = factory.start(context, options)
    except (RobotError, msgspec.ValidationError) as error:
        raise HttpError(
            400,
            BAD_REQUESTS["POST /api/core/motion/v1/actions"],
            why_invalid(error, field="options", wanted=factory and factory.options),
        ) from None
    for other in before:
        if other is not action:  # MoveBy continues
            other.cancel(f"{action.name} took over")
    return action


def _meant(name: str) -> str:
    """Return the action that a client may mean by an unknown name, as the end of a sentence."""
    return meant(name, {prefix + word for prefix in PREFIXES for word in FACTORIES})


def _navigation(context: Context) -> NavigationFeedback | None:
    feedback = part_of(action).feedback if (action := context.actions.current) else None
    return feedback if isinstance(feedback, NavigationFeedback) else None


def _path_points(points: Sequence[Point]) -> PathPoints:
    return PathPoints([(point.x, point.y) for point in points])
