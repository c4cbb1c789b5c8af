"""Chapter "motion", POST actions: precisely up to a printed tag or to reflectors, and away again.

Laser tags (type 1) and shelves (type 3) are refused: nothing on this robot makes them out.
"""

from __future__ import annotations

import math

from roboglot.model.actions import Action
from roboglot.model.components.battery import DockContact
from roboglot.model.components.driving import Driving
from roboglot.model.components.reflectors import Reflectors
from roboglot.model.components.vision import Vision
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.perception import ReflectorSeen, TagSeen
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.errands import PART, Errand, run_errand
from roboglot.protocols.slamware.moves import navigate
from roboglot.protocols.slamware.operations import Desk
from roboglot.wire.slamware.geometry import Pose3D
from roboglot.wire.slamware.motion import BackOffFromTagOptions, MoveOptions, MoveToTagOptions, TagType

LOOK_SECONDS, LOOK_PERIOD = 4.0, 0.1  # how long a tag is looked for, how often
CLOSE = 0.1  # m before the hull, where the client does not say how near
LANE = 0.5  # m before the goal from where the way is straight
ASIDE, CORRECTIONS = 0.02, 4  # m beside the axis that are put right, and how often
SPEED = 0.2  # m/s
ROOM_TO_TURN = 0.3  # m beyond the hull's radius
STEP = 0.2  # m between two looks while backing off with care


def move_to_tag(desk: Desk, options: MoveToTagOptions) -> Action:
    """To the target, and from there to a place before the tag that is seen there."""
    _ = _sense(desk.robot, options.tag_type)

    async def work(errand: Errand) -> None:
        for tries_left in reversed(range(1 + (options.dock_retry_count or 0))):
            try:
                await _dock(errand, options)
                return
            except NotFound:
                if not tries_left:
                    raise

    return run_errand(desk.robot, "move to tag", work, options.tag_ids)


async def _dock(errand: Errand, options: MoveToTagOptions) -> None:
    robot, target = errand.robot, options.target
    start = navigate(robot, [Pose(target.x, target.y).point], MoveOptions(), source=PART, yaw=wrap_angle(target.yaw))
    await errand.do(start)
    wanted = options.target_relative_pose
    near = wanted.x if wanted else robot.description.radius + CLOSE
    aside = wanted.y if wanted else 0.0
    for _ in range(CORRECTIONS):
        seen = await _look(robot, options)
        goal = seen.compose(Pose(near, aside, math.pi))  # facing the tag
        if abs(goal.y) <= ASIDE and abs(goal.yaw) <= ASIDE:
            break
        await _go(errand, goal.compose(Pose(-LANE)))
    else:
        goal = (await _look(robot, options)).compose(Pose(near, aside, math.pi))
    await _turn(errand, goal.yaw)
    ahead = math.hypot(goal.x, goal.y) if goal.x > 0 else goal.x
    if options.backward_docking:
        await _turn(errand, math.pi)
    await _straight(errand, -ahead if options.backward_docking else ahead)
    await _turn(errand, options.turn_radian or 0.0)


async def _go(errand: Errand, goal: Pose) -> None:
    """To a pose in base_link: a turn, a straight way, a turn; backwards if that is behind."""
    bearing = math.atan2(goal.y, goal.x)
    way = 1.0 if abs(bearing) <= math.pi / 2 else -1.0
    first = bearing if way > 0 else wrap_angle(bearing + math.pi)
    await _turn(errand, first)
    await _straight(errand, way * math.hypot(goal.x, goal.y))
    await _turn(errand, wrap_angle(goal.yaw - first))


async def _turn(errand: Errand, angle: float) -> None:
    if angle:
        await errand.do(errand.robot[Driving].move_by(Pose(yaw=angle), source=PART))


async def _straight(errand: Errand, distance: float) -> None:
    if distance:
        await errand.do(errand.robot[Driving].move_by(Pose(distance), speed=SPEED, source=PART))


def _sense(robot: Robot, kind: TagType) -> Vision | Reflectors:
    match kind:
        case TagType.VISUAL:
            return robot[Vision]
        case TagType.REFLECTORS:
            return robot[Reflectors]
        case _:
            raise InvalidGoal("this robot makes out printed tags and reflectors only")


async def _look(robot: Robot, options: MoveToTagOptions) -> Pose:
    """Where the tag is in base_link, +x out of it; NotFound if none is seen."""
    sense = _sense(robot, options.tag_type)
    detector = sense.tags if isinstance(sense, Vision) else sense.detector
    begun = robot.clock.time()
    with detector.subscribe():
        while robot.clock.time() < begun + LOOK_SECONDS:
            await robot.clock.sleep(LOOK_PERIOD)
            sighting = detector.latest
            if sighting is None or sighting.stamp < begun:
                continue
            tags = [seen for seen in sighting.seen if isinstance(seen, TagSeen)]
            ids = {str(id) for id in options.tag_ids or ()}
            if tag := next((tag for tag in tags if not ids or tag.text in ids), None):
                return tag.pose
            strips = [seen for seen in sighting.seen if isinstance(seen, ReflectorSeen)]
            if len(strips) >= (count := options.reflect_tag_num or 1):
                return _between(strips[:count])
    raise NotFound("the tag was not found")


def _between(strips: list[ReflectorSeen]) -> Pose:
    """The middle of the nearest strips, facing the robot: square to their line, or straight at it for a single one."""
    x = sum(strip.place.x for strip in strips) / len(strips)
    y = sum(strip.place.y for strip in strips) / len(strips)
    yaw = math.atan2(-y, -x)
    if len(strips) > 1:
        first, last = min(strips, key=_left).place, max(strips, key=_left).place
        square = first.bearing_to(last) + math.pi / 2
        yaw = square if math.cos(square - yaw) > 0 else square + math.pi
    return Pose(x, y, wrap_angle(yaw))


def _left(strip: ReflectorSeen) -> float:
    return strip.place.y


def back_off_from_tag(desk: Desk, options: BackOffFromTagOptions) -> Action:
    """Straight away from where it docked; with care, it looks at the tag now and then and keeps square to it."""
    robot = desk.robot
    distance = options.backup_distance or options.back_up_distance or robot.description.radius + ROOM_TO_TURN
    watches = options.backup_mode == 1 and not options.backward_docking
    if watches:
        _ = _sense(robot, options.tag_type)
    looking = MoveToTagOptions(Pose3D(0.0, 0.0), options.tag_type)

    async def work(errand: Errand) -> None:
        if DockContact in robot and robot[DockContact].docked:
            return  # whoever leaves the dock does that by itself
        gone = 0.0
        while gone < distance:
            step = min(STEP, distance - gone) if watches else distance
            if watches and gone:
                await _turn(errand, wrap_angle((await _look(robot, looking)).yaw - math.pi))
            await _straight(errand, step if options.backward_docking else -step)
            gone += step

    return run_errand(robot, "back off from tag", work, distance)
