"""Chapter "motion", POST actions: precise docking at a tag, board, reflectors or shelf, and backing off."""

from __future__ import annotations

import msgspec

from roboglot.model.actions import Action
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.tag_docking import Mark, MarkGoal, TagDocking
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.chapters.motion.home_docks import NAME
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.vocabulary import pose3d, pose_of
from roboglot.wire.slamware.chapters.motion import (
    BackOffFromTagOptions,
    MoveToTagOptions,
    ScheduledMoveToTagOptions,
    ScheduledTarget,
    TagType,
    TagWishes,
)

MARKS = {
    TagType.VISUAL: Mark.PRINTED,
    TagType.LASER: Mark.BOARD,
    TagType.REFLECTORS: Mark.REFLECTORS,
    TagType.SHELF: Mark.SHELF,
}


def move_to_tag(context: Context, options: MoveToTagOptions) -> Action:
    """Drive to the target, and from there to a pose in front of the tag seen there, or under the shelf."""
    offset = options.target_relative_pose
    goal = MarkGoal(
        mark=MARKS[options.tag_type],
        start=pose_of(options.target),
        place=Point(offset.x, offset.y) if offset and options.tag_type is not TagType.SHELF else None,
        backward=options.backward_docking,
        turn=wrap_angle(options.turn_radian or 0.0),
        texts=frozenset(map(str, options.tag_ids or ())),
        strips=options.reflect_tag_num or 1,
        outside=options.dock_allowance or None,
        retries=options.dock_retry_count or 0,
    )
    return _docking(context, goal.mark).dock_at(goal, source=SOURCE)


def scheduled_move_to_tag(context: Context, options: ScheduledMoveToTagOptions) -> Action:
    """Dock as MoveToTag does, from a place of this floor or a pose."""
    target = pose3d(pose_of_target(context.robot, options.target))
    wishes = options.move_to_tag_options or TagWishes()
    return move_to_tag(context, MoveToTagOptions(target=target, **msgspec.structs.asdict(wishes)))


def pose_of_target(robot: Robot, target: ScheduledTarget) -> Pose:
    """Return the pose, or that of a place of this floor by name or id. Raises NotFound."""
    if not target.poi_name:
        return Pose(target.x, target.y, wrap_angle(target.yaw))
    for place in robot[Places].all():
        if target.poi_name in (place.metadata.get(NAME), place.id):
            return place.pose
    raise NotFound("POI not found")


def back_off_from_tag(context: Context, options: BackOffFromTagOptions) -> Action:
    """Back straight off the mark; with care, keeping square to the visible tag."""
    mark = MARKS[options.tag_type]
    return _docking(context, mark).back_off(
        mark,
        distance=options.backup_distance or options.back_up_distance or None,
        ahead=options.backward_docking,
        watchful=options.backup_mode == 1,
        source=SOURCE,
    )


def _docking(context: Context, mark: Mark) -> TagDocking:
    docking = context.robot[TagDocking]
    if mark not in docking.marks:
        raise InvalidGoal(f"this robot cannot detect such a mark: {mark}")
    return docking
