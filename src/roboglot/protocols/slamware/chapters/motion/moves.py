"""Chapter "motion", POST actions: drives and turns."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.model.actions import Action
from roboglot.model.components.mapping.annotations import AreaKind, LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.track_graph import through_tracks
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions, Tracks
from roboglot.model.components.motion.sweeping import Sweeping
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point, Pose, Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.chapters.motion.strategies import speed_share
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.vocabulary import TRACKS
from roboglot.wire.slamware import geometry
from roboglot.wire.slamware.chapters.motion import (
    AngleOptions,
    Direction,
    FollowPathPointsOptions,
    MoveByOptions,
    MoveOptions,
    MoveToOptions,
    SeriesMoveToOptions,
    SweepOptions,
)

MOVE_BY_SECONDS = 0.5
MOVE_BY_TWIST = Twist(x=0.4, yaw=0.8)  # speed for a bare direction: slow, because there is no obstacle avoidance
SPEED_RATIO_MIN = 0.1
OCCUPIED = 0.1  # m from an occupied target that suffice
PRECISE, OCCUPIED_MAX = 0.05, 10.0  # m


def navigate(
    robot: Robot, goals: Sequence[Point], how: MoveOptions, *, source: str = SOURCE, yaw: float | None = None
) -> Action:
    """Drive through ``goals`` with the client's options; ``yaw``: final heading, which overrides them."""
    if yaw is None and how.has("with_yaw") and how.yaw is not None:
        yaw = wrap_angle(how.yaw)
    if how.mode and how.has("with_directed_virtual_track"):
        tracks = robot[MapAnnotations].current.lines_of(LineKind.TRACK)
        goals = through_tracks(tracks, robot[Localization].pose.point, goals, strictly=how.mode == 1)
    return robot[Navigation].navigate_to(goals, navigation_options(robot, how, yaw), source=source)


def navigation_options(robot: Robot, how: MoveOptions, yaw: float | None) -> NavigationOptions:
    """Return the model's options. Raises InvalidGoal for options impossible on this map."""
    tracks = TRACKS[how.mode]
    if tracks is Tracks.STRICT and not has_tracks(robot):
        raise InvalidGoal("the map has no tracks to keep to")
    share = min(max(how.speed_ratio, SPEED_RATIO_MIN), 1.0) if how.speed_ratio else 1.0
    return NavigationOptions(
        yaw=yaw,
        tracks=tracks,
        speed_ratio=max(share * speed_share(robot), SPEED_RATIO_MIN),
        tolerance=tolerance_of(how) or OCCUPIED,
        retries=how.fail_retry_count or 0 if how.has("fail_retry_count") else 0,
        waits=how.has("find_path_ignoring_dynamic_obstacles"),
    )


def tolerance_of(how: MoveOptions) -> float | None:
    """Return the distance (m) from the target that counts as arrived; None if the client leaves it open."""
    if how.acceptable_precision:  # it says nothing of how precisely a free target is reached, so ``precise`` may stand
        return min(max(how.acceptable_precision, PRECISE), OCCUPIED_MAX)
    return PRECISE if how.has("precise") else None


def has_tracks(robot: Robot) -> bool:
    """Return whether the map has tracks."""
    return MapAnnotations in robot and bool(robot[MapAnnotations].current.lines_of(LineKind.TRACK))


def _points(places: Sequence[geometry.Location | geometry.Point]) -> list[Point]:
    return [Point(place.x, place.y) for place in places]


def move_to(context: Context, options: MoveToOptions) -> Action:
    """Drive to one place."""
    return navigate(context.robot, _points([options.target]), options.move_options or MoveOptions())


def series_move_to(context: Context, options: SeriesMoveToOptions) -> Action:
    """Drive through several points in turn."""
    return navigate(context.robot, _points(options.targets), options.move_options or MoveOptions())


def follow_path_points(context: Context, options: FollowPathPointsOptions) -> Action:
    """Drive along a polyline, around obstacles on it."""
    return navigate(context.robot, _points(options.path_points), options.move_options or MoveOptions())


def sweep(context: Context, options: SweepOptions) -> Action:
    """Sweep coverage areas of the map, all or by id, in lanes."""
    wanted = options.sweep_options
    drawn = context.robot[MapAnnotations].current.areas_of(AreaKind.COVERAGE)
    ids = set(wanted.region_ids or ()) if wanted else set()
    if missing := ids - {area.id for area in drawn}:
        raise InvalidGoal(f"there are no coverage areas {sorted(missing)[:20]}")
    chosen = [area for area in drawn if area.id in ids] if ids else drawn
    return context.robot[Sweeping].sweep(chosen, width=(wanted.spacing or None) if wanted else None, source=SOURCE)


def move_by(context: Context, options: MoveByOptions) -> Action:
    """Drive by remote control."""
    limit = context.robot[Base].limits.twist
    match options:
        case MoveByOptions(direction=None, theta=None):
            raise InvalidGoal("give either direction or theta")
        case MoveByOptions(direction=Direction(), theta=float(theta)) if theta:  # clients send 0 for "unset"
            raise InvalidGoal("give either direction or theta, not both")
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
    return context.robot[Driving].drive(twist.clamped(limit), lifetime=seconds, source=SOURCE)


def rotate(context: Context, options: AngleOptions) -> Action:
    """Turn by an angle."""
    return context.robot[Driving].move_by(Pose(yaw=options.angle), source=SOURCE)


def rotate_to(context: Context, options: AngleOptions) -> Action:
    """Turn to a heading in the shorter direction."""
    turn = wrap_angle(options.angle - context.robot[Localization].pose.yaw)
    return context.robot[Driving].move_by(Pose(yaw=turn), source=SOURCE)
