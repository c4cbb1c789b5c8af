"""Chapter "motion", POST actions: from an action name and its options to an action of the robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from roboglot.model.actions import Action
from roboglot.model.components.annotations import LineKind, MapAnnotations
from roboglot.model.components.base import Base
from roboglot.model.components.component import Component
from roboglot.model.components.docking import Docking
from roboglot.model.components.driving import Driving
from roboglot.model.components.localization import Localization
from roboglot.model.components.navigation import Navigation, NavigationOptions, Tracks
from roboglot.model.errors import InvalidGoal, RobotError
from roboglot.model.geometry import Point, Pose, Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.errors import BAD_REQUESTS, HttpError
from roboglot.protocols.slamware.vocabulary import action_word
from roboglot.wire.slamware.geometry import Location
from roboglot.wire.slamware.motion import (
    ActionRequest,
    AngleOptions,
    Direction,
    GoHomeOptions,
    MoveByOptions,
    MoveOptions,
    MoveToOptions,
    SeriesMoveToOptions,
)

SOURCE = "slamware"
MOVE_BY_SECONDS = 0.5
MOVE_BY_TWIST = Twist(x=0.4, yaw=0.8)  # how fast a bare direction drives: slow, for nobody looks out for obstacles
SPEED_RATIO_MIN = 0.1
STRICT_TRACK = 1
TRACKS = (Tracks.FREE, Tracks.STRICT, Tracks.PREFERRED)  # by move mode


@dataclass(frozen=True, slots=True)
class Factory:
    """One kind of action: its options, the components that it takes, and how to start it."""

    options: type[msgspec.Struct]
    start: Callable[[Robot, Any], Action]
    needs: tuple[type[Component], ...]


def create(robot: Robot, request: ActionRequest) -> Action:
    """Start the action. Raises HttpError 400 with the manual's words for whatever stands against it."""
    try:
        factory = FACTORIES.get(action_word(request.action_name) or "")
        if factory is None:
            raise InvalidGoal(f"this robot does not know {request.action_name}")
        options = msgspec.convert(request.options or {}, factory.options, strict=False)
        return factory.start(robot, options)
    except (RobotError, msgspec.ValidationError) as error:
        raise HttpError(400, BAD_REQUESTS["POST /api/core/motion/v1/actions"], str(error)) from None


def _move_to(robot: Robot, options: MoveToOptions) -> Action:
    return _navigate(robot, [options.target], options.move_options or MoveOptions())


def _series_move_to(robot: Robot, options: SeriesMoveToOptions) -> Action:
    return _navigate(robot, options.targets, options.move_options or MoveOptions())


def _navigate(robot: Robot, targets: Sequence[Location], how: MoveOptions) -> Action:
    if how.mode not in (0, 1, 2):
        raise InvalidGoal(f"there is no move mode {how.mode}")
    if how.mode == STRICT_TRACK and not _has_tracks(robot):
        raise InvalidGoal("the map has no tracks to keep to")
    options = NavigationOptions(
        yaw=wrap_angle(how.yaw) if how.has("with_yaw") and how.yaw is not None else None,
        tracks=TRACKS[how.mode],
        speed_ratio=min(max(how.speed_ratio, SPEED_RATIO_MIN), 1.0) if how.speed_ratio else 1.0,
        retries=how.fail_retry_count or 0 if how.has("fail_retry_count") else 0,
    )
    goals = [Point(target.x, target.y) for target in targets]
    return robot[Navigation].navigate_to(goals, options, source=SOURCE)


def _has_tracks(robot: Robot) -> bool:
    return MapAnnotations in robot and bool(robot[MapAnnotations].current.lines_of(LineKind.TRACK))


def _move_by(robot: Robot, options: MoveByOptions) -> Action:
    limit = robot[Base].limits.twist
    match options:
        case MoveByOptions(direction=None, theta=None):
            raise InvalidGoal("either direction or theta is needed")
        case MoveByOptions(direction=None, theta=float(theta)):
            twist = Twist(yaw=theta)
        case MoveByOptions(direction=Direction.FORWARD):
            twist = Twist(x=MOVE_BY_TWIST.x)
        case MoveByOptions(direction=Direction.BACKWARD):
            twist = Twist(x=-MOVE_BY_TWIST.x)
        case MoveByOptions(direction=Direction.TURN_RIGHT):
            twist = Twist(yaw=-MOVE_BY_TWIST.yaw)
        case _:
            twist = Twist(yaw=MOVE_BY_TWIST.yaw)
    seconds = options.duration / 1000 if options.duration else MOVE_BY_SECONDS
    return robot[Driving].drive(twist.clamped(limit), lifetime=seconds, source=SOURCE)


def _rotate(robot: Robot, options: AngleOptions) -> Action:
    return robot[Driving].move_by(Pose(yaw=options.angle), source=SOURCE)


def _rotate_to(robot: Robot, options: AngleOptions) -> Action:
    turn = wrap_angle(options.angle - robot[Localization].pose.yaw)
    return robot[Driving].move_by(Pose(yaw=turn), source=SOURCE)


def _go_home(robot: Robot, options: GoHomeOptions) -> Action:
    flags = options.gohome_options.flags if options.gohome_options else None
    if flags == "no_dock":
        raise InvalidGoal("this robot only goes home to dock")
    return robot[Docking].dock(source=SOURCE)


FACTORIES: dict[str, Factory] = {
    "MoveToAction": Factory(MoveToOptions, _move_to, (Navigation,)),
    "SeriesMoveToAction": Factory(SeriesMoveToOptions, _series_move_to, (Navigation,)),
    "MoveByAction": Factory(MoveByOptions, _move_by, (Driving, Base)),
    "RotateAction": Factory(AngleOptions, _rotate, (Driving,)),
    "RotateToAction": Factory(AngleOptions, _rotate_to, (Driving, Localization)),
    "GoHomeAction": Factory(GoHomeOptions, _go_home, (Docking,)),
}
