"""Chapter "tasks": start (6004), rejoin (6010), stop (6009) an algorithm task; one stream from acceptance to result."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from functools import partial

from roboglot.model.components.component import Component
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.mapping import Mapping as MappingComponent
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.following import Following
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.ultra_wideband import UltraWideband
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import InvalidGoal
from roboglot.operations import BadParameters, Right
from roboglot.protocols.cyberdog.call import Call, follow
from roboglot.protocols.cyberdog.chapters.mapping.docking import dock
from roboglot.protocols.cyberdog.chapters.mapping.mapping import build_map, keep_map
from roboglot.protocols.cyberdog.chapters.mapping.navigation import Goal, navigate, relocalize
from roboglot.protocols.cyberdog.chapters.mapping.task_state import OUTDOORS, Task, TaskRequest
from roboglot.protocols.cyberdog.chapters.people.following import (
    AUTOMATIC,
    Manner,
    follow_person,
    follow_tag,
    follow_thing,
    manner_of,
)
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.profile import Profile
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.codes import Accepted, Code, MachineState, StopResult, TaskResult, TaskState, TaskType
from roboglot.wire.cyberdog.text import Int32

STREAM_MAX = 7200.0  # s for which one stream stays open for its result
STOP_MAX = 60.0  # s
NEEDS: Mapping[TaskType, tuple[type[Component], ...]] = {
    TaskType.NAVIGATION: (Navigation, Localization, MappingComponent),
    TaskType.MAPPING: (MappingComponent, Localization),
    TaskType.LOCALIZATION: (Localization, Lidar, MappingComponent),
    TaskType.DOCKING: (Docking,),
    TaskType.VISION_FOLLOWING: (Following, Vision),
    TaskType.UWB_FOLLOWING: (Following, UltraWideband),
}
NEEDS_FOR_THINGS: tuple[type[Component], ...] = (Following, Camera, Lidar)
FOLLOWS = frozenset({TaskType.VISION_FOLLOWING, TaskType.UWB_FOLLOWING})
IN_A_MAP = frozenset({TaskType.NAVIGATION, TaskType.MAPPING, TaskType.LOCALIZATION})  # where ``outdoor`` matters
LEAVES: Mapping[TaskResult, TaskState] = {
    TaskResult.SUCCESS: TaskState.LOCALIZED,
    TaskResult.FAILED: TaskState.LOCALIZATION_FAILED,
}
_INDOORS = {TaskState.LOCALIZING, TaskState.LOCALIZED, TaskState.LOCALIZATION_FAILED, TaskState.NAVIGATING}
NAVIGATION_STATES = _INDOORS | {OUTDOORS[state] for state in _INDOORS}


@TABLE.on(
    Code.START_TASK,
    right=Right.DRIVE,
    needs=(Localization, MappingComponent),  # a robot without a map has nothing that the other tasks need
    some=(Docking, Following, Navigation),
)
async def start_task(
    call: Call,
    *,
    type: Int32,
    outdoor: bool = False,
    goalX: float | None = None,  # noqa: N803 - the wire's names
    goalY: float | None = None,  # noqa: N803
    theta: float | None = None,
    object_tracking: bool = False,
    relative_pos: Int32 = AUTOMATIC,
    keep_distance: float = 0.0,
) -> object:
    """Start a task; answer ``accepted``, feedback codes, ``result``. The task continues if the stream breaks."""
    context = call.context
    if type not in NEEDS:
        return call.refused({"accepted": int(Accepted.NO)}, f"there is no task of type {type}")
    kind = TaskType(type)
    order = TaskRequest(kind, outdoor and kind in IN_A_MAP, object_tracking and kind is TaskType.VISION_FOLLOWING)
    context.robot.require(*NEEDS_FOR_THINGS if order.thing else NEEDS[kind])
    if kind is TaskType.NAVIGATION and (goalX is None or goalY is None):
        raise InvalidGoal("a goal needs goalX and goalY")
    manner = manner_of(relative_pos, keep_distance) if kind in FOLLOWS else manner_of(AUTOMATIC, 0.0)
    if why := _hindrance(context, order):
        return call.refused({"accepted": int(Accepted.NO)}, why)
    run = _run(context, order, Goal(goalX or 0.0, goalY or 0.0, theta), manner)
    task = context.tasks.start(order, run, then=LEAVES if kind is TaskType.LOCALIZATION else {})
    return await follow(call, task.stream, STREAM_MAX)


def _hindrance(context: Context, order: TaskRequest) -> str:
    """Return the reason why the task cannot begin now, or ""."""
    if context.gaits.state is MachineState.LOW_POWER:
        return "the robot is in low power"
    state = context.tasks.state
    if state in order.begins_in:
        return ""
    if context.tasks.current is not None:
        return f"another task is under way ({state.name.lower().replace('_', ' ')})"
    if order.kind is TaskType.NAVIGATION:
        return "the robot is not localized; 6004 of type 7 localizes it"
    return f"a task of type {int(order.kind)} cannot begin while the robot is {state.name.lower().replace('_', ' ')}"


def _run(context: Context, order: TaskRequest, goal: Goal, manner: Manner) -> Callable[[Task], Awaitable[TaskResult]]:
    """Return the coroutine that carries out a task."""
    match order.kind:
        case TaskType.NAVIGATION:
            return partial(navigate, context, goal=goal)
        case TaskType.MAPPING:
            return partial(build_map, context, outdoor=order.outdoor)
        case TaskType.LOCALIZATION:
            return partial(relocalize, context, outdoor=order.outdoor)
        case TaskType.UWB_FOLLOWING:
            return partial(follow_tag, context, manner=manner)
        case TaskType.VISION_FOLLOWING:
            return partial(follow_thing if order.thing else follow_person, context, manner=manner)
        case _:
            return partial(dock, context)


@TABLE.on(Code.JOIN_TASK, right=Right.SEE)
async def join_task(call: Call, *, type: Int32) -> object:
    """Take over the stream of a running task, from its latest feedback on."""
    task = call.context.tasks.current
    if task is None or task.kind != _kind_of(call.context, type):
        return call.refused({"accepted": int(Accepted.NOTHING_TO_JOIN)}, f"no task of type {type} is under way")
    return await follow(call, task.stream, STREAM_MAX)


@TABLE.on(Code.STOP_TASK, right=Right.DRIVE, needs=(MapLibrary, MappingComponent))
async def stop_task(call: Call, *, type: Int32, map_name: object = "") -> dict[str, object]:
    """Stop the task of that type, if it runs; 0 stops every task, localization included.

    A map under construction is saved as ``map_name``. Without a name, 5 discards it and 0 keeps it in memory.
    """
    if not isinstance(map_name, str):
        raise BadParameters("map_name must be a text")  # taken as absent, it would discard the map
    if type == TaskType.MAPPING:
        call.check_spelling("map_name")
    try:
        result = await call.context.robot.clock.wait_for(_stop(call.context, type, map_name), STOP_MAX)
    except TimeoutError:
        result = StopResult.NO_ANSWER
    return {"result": int(result)}


async def _keep_map(context: Context, name: str) -> bool:
    """Save the new map, or discard it without a name; return whether that succeeded.

    In the manual a saved map is a success (0); real robots end the stream as stopped (5).
    """
    task = context.tasks.current
    if not await keep_map(context, name):
        return False
    if task and name and context.profile is Profile.SPEC:
        task.stopped_as = TaskResult.SUCCESS
    return True


def _kind_of(context: Context, type: int) -> int:
    """Return the kind of a task type; following an object also goes by its state's number."""
    following_a_thing = context.tasks.state is TaskState.THING_FOLLOWING
    return TaskType.VISION_FOLLOWING if following_a_thing and type == TaskState.THING_FOLLOWING else type


async def _stop(context: Context, type: int, map_name: str) -> StopResult:
    tasks = context.tasks
    running, type = tasks.current.kind if tasks.current else None, _kind_of(context, type)
    match type:
        case TaskType.ALL:
            if running == TaskType.MAPPING and map_name and not await _keep_map(context, map_name):
                return StopResult.FAILED
            await tasks.stop()
            tasks.leave()
        case TaskType.MAPPING if running == type:
            if not await _keep_map(context, map_name):
                return StopResult.FAILED
            await tasks.stop()
        case TaskType.MAPPING if map_name:
            return StopResult.FAILED  # there is no map to be saved
        case TaskType.LOCALIZATION if running is None and tasks.state in NAVIGATION_STATES:
            tasks.leave()
        case _ if running == type:
            await tasks.stop()
    return StopResult.STOPPED
