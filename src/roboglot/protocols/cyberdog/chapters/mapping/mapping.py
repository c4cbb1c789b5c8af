"""Chapter "mapping": building a map as a task of 6004, and saving it when 6009 ends it."""

from __future__ import annotations

import logging

from roboglot.confirmation import confirmed
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.map_memory import check_store
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import Refused, RobotError
from roboglot.model.events import MapReplaced
from roboglot.model.map_loading import known_dock
from roboglot.protocols.cyberdog.chapters.mapping.labels import NAME_MAX
from roboglot.protocols.cyberdog.chapters.mapping.survey import Survey
from roboglot.protocols.cyberdog.chapters.mapping.task_state import Task
from roboglot.protocols.cyberdog.context import Context
from roboglot.wire.cyberdog.codes import Feedback, TaskResult

log = logging.getLogger(__name__)
FIX_PERIOD = 1.0  # s between two checks for satellites


async def build_map(context: Context, task: Task, *, outdoor: bool) -> TaskResult:
    """Start an empty map where the robot stands and add scans until the task is stopped.

    Outdoors, satellite fixes on the way are kept with it, to georeference it. Fails if the map is replaced meanwhile.
    """
    robot, mapping, survey = context.robot, context.robot[Mapping], Survey(outdoor)
    enabled = mapping.enabled
    await check_store(robot)
    async with confirmed():
        mapping.clear()
        mapping.enable(True)
    context.stored_map, context.survey = "", survey
    task.feedback(Feedback.MAPPING_STARTED)

    def note(event: MapReplaced) -> None:
        if event.origin is None or not mapping.grid.width:  # otherwise the same map continues at another origin
            survey.replaced = True

    forget = robot.events.listen(MapReplaced, note)
    try:
        while not survey.replaced:  # only 6009 ends it otherwise
            survey.look(robot)
            await robot.clock.sleep(FIX_PERIOD)
    finally:
        forget()
        mapping.enable(enabled)
    return task.fail(Feedback.MAPPING_FAILED, Refused("another client replaced the map"))


async def keep_map(context: Context, name: str) -> bool:
    """Save the map under ``name`` (on disk on return), or discard it without one. False on failure."""
    mapping = context.robot[Mapping]
    if context.survey.replaced:
        return not name
    if not name:
        try:
            await check_store(context.robot)
        except RobotError as error:
            log.warning("the map was not discarded: %s", error)
            return False
        mapping.clear()
        return True
    grid = mapping.grid
    if grid.width == 0 or len(name) > NAME_MAX:
        return False
    survey, before = context.survey, context.stored_map
    context.stored_map = name  # before it is on disk: another client that replaces the map meanwhile clears it
    try:
        library, dock, stamp = context.robot[MapLibrary], known_dock(context.robot), context.robot.clock.epoch()
        await library.put(StoredMap(name, grid, stamp, outdoor=survey.outdoor, anchor=survey.anchor, dock=dock))
    except (RobotError, OSError) as error:
        log.warning("map %r was not saved: %s", name, error)
        if context.stored_map == name:
            context.stored_map = before
        return False
    return True
