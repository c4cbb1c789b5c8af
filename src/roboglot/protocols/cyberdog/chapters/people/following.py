"""Chapter "following": a person chosen in the picture (6008), or the wearer of the bracelet: tasks of 6004."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial

import msgspec

from roboglot.model.actions import Action
from roboglot.model.components.motion.following import DISTANCE_MAX, DISTANCE_MIN, Following, FollowSide
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.events import ActionChanged
from roboglot.operations import BadParameters, Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.mapping.task_state import Task
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.chapters.people.pursuit import Pursuit, ThingPursuit
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.validation import why_invalid
from roboglot.values import dataclass
from roboglot.wire.cyberdog.codes import Code, Feedback, TaskResult

AUTOMATIC = 200  # ``relative_pos`` that leaves the choice to the robot
SIDES = {AUTOMATIC: FollowSide.BEHIND, 201: FollowSide.BEHIND, 202: FollowSide.LEFT, 203: FollowSide.RIGHT}
DISTANCE = 1.0  # m, unless the app sets one


class Region(msgspec.Struct):
    """A part of a picture of 640 by 480 pixels."""

    x_offset: int
    y_offset: int
    height: int
    width: int


@dataclass(frozen=True, slots=True)
class Manner:
    """Manner of following: side of the person, and distance (m)."""

    side: FollowSide
    distance: float


def manner_of(relative_pos: int, keep_distance: float) -> Manner:
    """Return the manner for the wire's numbers; 0 m: default. Raises BadParameters for an unknown side."""
    if relative_pos not in SIDES:
        raise BadParameters("relative_pos must be 200 to 203")
    distance = keep_distance if keep_distance > 0.0 else DISTANCE
    return Manner(SIDES[relative_pos], max(DISTANCE_MIN, min(DISTANCE_MAX, distance)))


async def follow_person(context: Context, task: Task, manner: Manner) -> TaskResult:
    """Push the people in sight, wait for the app's choice, and follow until stopped or the person is lost."""
    pursuit = Pursuit(context.robot, context.app)
    follow = partial(context.robot[Following].follow, side=manner.side, distance=manner.distance, source=SOURCE)
    return await _pursue(context, task, pursuit, follow)


async def follow_thing(context: Context, task: Task, manner: Manner) -> TaskResult:
    """Wait for the app to choose a region of the picture, and follow the lidar's object there."""
    pursuit = ThingPursuit(context.robot, context.app)
    follow = partial(context.robot[Following].follow_thing, side=manner.side, distance=manner.distance, source=SOURCE)
    return await _pursue(context, task, pursuit, follow)


async def _pursue(
    context: Context, task: Task, pursuit: Pursuit | ThingPursuit, follow: Callable[[object], Action]
) -> TaskResult:
    task.feedback(Feedback.ACTIVATING)
    task.feedback(Feedback.FOLLOW_STARTING)
    context.pursuit = pursuit
    watching = asyncio.get_running_loop().create_task(pursuit.watch(), name="tracking boxes")
    try:
        task.feedback(Feedback.FOLLOW_WAITS_FOR_CHOICE)
        chosen = await pursuit.chosen
        task.feedback(Feedback.FOLLOW_CHOSEN)
        action = task.action = follow(chosen)
        await _report(context, task, action, Feedback.FOLLOWING, Feedback.TARGET_SEARCHED)
        return TaskResult.FAILED  # it ends by itself only if the target is gone
    except NotFound as error:
        locked = task.last is not Feedback.FOLLOW_CHOSEN
        return task.fail(Feedback.TARGET_LOST if locked else Feedback.TARGET_NOT_LOCKED, error)
    finally:
        context.pursuit = None
        watching.cancel()


async def follow_tag(context: Context, task: Task, manner: Manner) -> TaskResult:
    """Follow the wearer of the connected bracelet until stopped or out of range."""
    task.feedback(Feedback.ACTIVATING)
    try:
        action = task.action = context.robot[Following].follow_tag(
            side=manner.side, distance=manner.distance, source=SOURCE
        )
    except RobotError as error:
        return task.fail(Feedback.ACTIVATION_FAILED, error)
    task.feedback(Feedback.ACTIVATED)
    try:
        await _report(context, task, action, Feedback.TAG_FOLLOWED, None)
        return TaskResult.FAILED
    except NotFound as error:
        return task.fail(Feedback.TAG_LOST if task.last is Feedback.TAG_FOLLOWED else Feedback.TAG_NOT_THERE, error)
    except RobotError as error:
        return task.fail(Feedback.TAG_CONTROL_FAILED, error)


async def _report(context: Context, task: Task, action: Action, followed: Feedback, searched: Feedback | None) -> None:
    """Report the progress of ``action`` until it has ended; cancelled if the task is."""

    def watch(event: ActionChanged) -> None:
        if event.action is not action or action.feedback is None:
            return
        if action.feedback != "searching":
            task.feedback(followed)
        elif searched and task.last is not Feedback.FOLLOW_CHOSEN:  # a picture is needed until a person is followed
            task.feedback(searched)

    end_watch = context.robot.events.listen(ActionChanged, watch)
    try:
        await action.succeeded()
    except asyncio.CancelledError:
        action.cancel("the door closes")
        raise
    finally:
        end_watch()


@TABLE.on(Code.CHOOSE_TARGET, right=Right.DRIVE)
async def choose_target(call: Call, *, roi: object) -> dict[str, bool]:
    """Follow the person or object in a region of the picture (push 6007); false before 501, or if it is empty."""
    try:
        region = msgspec.convert(roi, Region)
    except msgspec.ValidationError as error:
        raise BadParameters(why_invalid(error, field="roi", wanted=Region)) from None
    pursuit = call.context.pursuit
    chosen = pursuit is not None and pursuit.choose(region.x_offset, region.y_offset, region.width, region.height)
    return {"success": chosen}
