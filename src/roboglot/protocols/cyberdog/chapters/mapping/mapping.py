"""Chapter "mapping": building a map as a task of 6004, and saving it when 6009 ends it."""

from __future__ import annotations

import logging

from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import RobotError
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

    Outdoors, satellite fixes on the way are kept with it, to georeference it.
    """
    mapping = context.robot[Mapping]
    enabled = mapping.enabled
    mapping.clear()
    mapping.enable(True)
    context.stored_map, context.survey = "", Survey(outdoor)
    task.feedback(Feedback.MAPPING_STARTED)
    try:
        while True:  # only 6009 ends it
            context.survey.look(context.robot)
            await context.robot.clock.sleep(FIX_PERIOD)
    finally:
        mapping.enable(enabled)


async def keep_map(context: Context, name: str) -> bool:
    """Save the map under ``name`` (on disk on return), or discard it without one. False on failure."""
    mapping = context.robot[Mapping]
    if not name:
        mapping.clear()
        return True
    grid = mapping.grid
    if grid.width == 0 or len(name) > NAME_MAX:
        return False
    try:
        library, survey = context.robot[MapLibrary], context.survey
        dock, stamp = known_dock(context.robot), context.robot.clock.epoch()
        await library.put(StoredMap(name, grid, stamp, outdoor=survey.outdoor, anchor=survey.anchor, dock=dock))
    except (RobotError, OSError) as error:
        log.warning("map %r was not saved: %s", name, error)
        return False
    context.stored_map = name
    return True
