"""Chapter "navigation": relocalisation and going to a point, as tasks of 6004; the path as push 6006."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from roboglot.confirmation import confirmed
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.mapping.localization import GOOD_FIT, Localization, Region
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.errors import Busy, NotLocalized, Refused, RobotError
from roboglot.model.events import ActionChanged
from roboglot.model.geodesy import GlobeAnchor, sky_over
from roboglot.model.geometry import Path, Point, Pose
from roboglot.model.map_loading import load_map
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.mapping.docking import keep_dock
from roboglot.protocols.cyberdog.chapters.mapping.labels import newest_map
from roboglot.protocols.cyberdog.chapters.mapping.task_state import Task
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.errors import codes_of
from roboglot.values import dataclass
from roboglot.wire.cyberdog.codes import Feedback, TaskResult

GIVE_UP_AFTER = 120.0  # s
NEAR = 0.5  # m around the believed pose that are searched first
LOOK_AT_MOST = 1.5  # s
FIRST_SCAN_MAX, FIRST_SCAN_PERIOD = (
    3.0,
    0.1,
)  # s that a robot just switched on may take to begin its map; s between looks
PATH_PERIOD = 1.0  # s between two paths


@dataclass(frozen=True, slots=True)
class Goal:
    """Goal of a drive in m (map), and the final heading ``theta`` in rad; None for any."""

    x: float
    y: float
    theta: float | None


async def relocalize(context: Context, task: Task, *, outdoor: bool) -> TaskResult:
    """Find the robot in the stored map of that kind, or in the current one; localization continues afterwards.

    If the latest scan fits the believed pose, that is kept; otherwise the whole map is searched, or, outdoors with a
    satellite fix, the area around the fix.
    """
    robot = context.robot
    task.feedback(Feedback.LOCALIZATION_CHECKING_MAP)
    stored = await newest_map(context, outdoor=outdoor)
    other = stored is not None and stored.name != context.stored_map  # saved by an earlier run of the program
    if stored is not None and other and stored.grid.width * stored.grid.height > 0:
        async with confirmed():
            load_map(robot, stored, Pose())
        context.stored_map = stored.name
    # Without a stored map the one in memory serves, unless it is of the other kind or was deleted.
    if not await _has_begun_map(robot) or (stored is None and (outdoor or context.stored_map or context.map_deleted)):
        task.feedback(Feedback.LOCALIZATION_MAP_UNUSABLE)
        return TaskResult.FAILED
    task.feedback(Feedback.LOCALIZATION_MAP_GOOD)
    task.feedback(Feedback.ACTIVATING)
    localization = robot[Localization]
    with suppress(Refused):  # a real dog is localized by the search alone
        localization.enable(True)
    task.feedback(Feedback.ACTIVATED)
    task.feedback(Feedback.LOCALIZATION_STARTING)
    task.feedback(Feedback.LOCALIZATION_STARTED)
    place = stored.anchor if stored else None
    if (other or not await _still_there(robot, task, place)) and not await _search(robot, task, place):
        return TaskResult.FAILED
    await keep_dock(context)
    task.feedback(Feedback.LOCALIZATION_DONE)
    return TaskResult.SUCCESS


async def _has_begun_map(robot: Robot) -> bool:
    """Return whether the map has any cells, after the first scan of a robot just switched on."""
    deadline = robot.clock.time() + FIRST_SCAN_MAX
    while not has_map(robot) and not robot[Localization].started and robot.clock.time() < deadline:
        await robot.clock.sleep(FIRST_SCAN_PERIOD)
    return has_map(robot)


async def _still_there(robot: Robot, task: Task, place: GlobeAnchor | None) -> bool:
    """Return whether the latest scan fits the believed pose; earlier quality proves nothing.

    The robot may have been carried away a moment ago.
    """
    localization = robot[Localization]
    if localization.quality < GOOD_FIT:
        return False
    x, y = localization.pose.x, localization.pose.y
    try:
        action = localization.relocalize(Region(x - NEAR, y - NEAR, x + NEAR, y + NEAR), source=SOURCE)
    except Refused:
        return False  # it can only search the whole map
    task.action = action
    try:
        await robot.clock.wait_for(action.succeeded(), LOOK_AT_MOST)
    except (RobotError, TimeoutError):
        return False
    else:
        sky = sky_over(place, robot)
        return sky is None or sky.allows(localization.pose.point)
    finally:
        action.cancel("it was to take a moment only")
        task.action = None


async def _search(robot: Robot, task: Task, place: GlobeAnchor | None) -> bool:
    """Search the map until a place fits; after each failure ask the user to drive a bit."""
    deadline = robot.clock.time() + GIVE_UP_AFTER
    while robot.clock.time() < deadline:
        sky = sky_over(place, robot)
        try:
            action = task.action = robot[Localization].relocalize(sky.region if sky else None, source=SOURCE)
        except RobotError as error:  # a lost link
            task.fail(Feedback.LOCALIZATION_FAILED, error)
            return False
        try:
            await action.succeeded()
            if sky is None or sky.allows(robot[Localization].pose.point):
                return True
            task.feedback(Feedback.LOCALIZATION_TRYING)  # other places look the same
            await robot.clock.sleep(LOOK_AT_MOST)
        except asyncio.CancelledError:
            action.cancel("the door closes")
            raise
        except NotLocalized:
            task.feedback(Feedback.LOCALIZATION_TRYING)
        except RobotError:  # another client has started a search
            task.feedback(Feedback.LOCALIZATION_FAILED)
            return False
        finally:
            task.action = None
    task.feedback(Feedback.LOCALIZATION_TIMEOUT)
    return False


async def navigate(context: Context, task: Task, *, goal: Goal) -> TaskResult:
    """Go to ``goal``; the app sees the path, and at the end an empty one."""
    robot = context.robot
    task.feedback(Feedback.CHECKING_MAP)
    if not has_map(robot):
        task.feedback(Feedback.NO_MAP)
        return TaskResult.FAILED
    task.feedback(Feedback.MAP_GOOD)
    task.feedback(Feedback.ACTIVATING)
    navigation = robot[Navigation]
    task.feedback(Feedback.ACTIVATED)
    task.feedback(Feedback.PLANNING)
    try:
        options = NavigationOptions(yaw=goal.theta)
        action = task.action = navigation.navigate_to([Point(goal.x, goal.y)], options, source=SOURCE)
        return await _arrive(context, task, action)
    except RobotError as error:
        return task.fail(codes_of(error).navigation, error)
    finally:
        context.reports.show_path(Path())


async def _arrive(context: Context, task: Task, action: Action) -> TaskResult:
    """Report the progress of ``action`` until it has ended; cancelled if the task is."""
    shown_at = -PATH_PERIOD
    clock = context.robot.clock

    def watch(event: ActionChanged) -> None:
        nonlocal shown_at
        if event.action is not action or not isinstance(feedback := action.feedback, NavigationFeedback):
            return
        if feedback.stage != "planning":
            task.feedback(Feedback.NAVIGATING)
        if clock.time() - shown_at >= PATH_PERIOD:
            shown_at = clock.time()
            context.reports.show_path(feedback.remaining)

    end_watch = context.robot.events.listen(ActionChanged, watch)
    try:
        status = await action.done()
    except asyncio.CancelledError:
        action.cancel("the door closes")
        raise
    finally:
        end_watch()
    if status is not ActionStatus.SUCCEEDED:
        raise action.error.again() if action.error else Busy(f"{action.name} was cancelled")
    task.feedback(Feedback.NAVIGATING)
    task.feedback(Feedback.ARRIVED)
    return TaskResult.SUCCESS


def has_map(robot: Robot) -> bool:
    """Return whether the map has any cells."""
    return robot[Mapping].grid.width > 0
