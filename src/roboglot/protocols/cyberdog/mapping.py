"""Chapter "mapping": building a map as a task of 6004, and saving it when 6009 ends it."""

from __future__ import annotations

import asyncio
import logging

from roboglot.model.components.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping import Mapping
from roboglot.model.errors import RobotError
from roboglot.protocols.cyberdog.dog import Dog
from roboglot.protocols.cyberdog.labels import NAME_MAX
from roboglot.protocols.cyberdog.task import Task
from roboglot.wire.cyberdog.codes import Feedback, TaskResult

log = logging.getLogger(__name__)


async def build_map(dog: Dog, task: Task) -> TaskResult:
    """Begin an empty map where the robot stands and add what the lidar sees, until the task is stopped."""
    mapping = dog.robot[Mapping]
    enabled = mapping.enabled
    mapping.clear()
    mapping.enable(True)
    dog.stored_map = ""
    task.feedback(Feedback.MAPPING_STARTED)
    try:
        await asyncio.get_running_loop().create_future()  # only 6009 ends it
        return TaskResult.SUCCESS
    finally:
        mapping.enable(enabled)


async def keep_map(dog: Dog, name: str) -> bool:
    """Save the map under ``name``, on disk when this returns; without a name throw it away. False if that failed."""
    mapping = dog.robot[Mapping]
    if not name:
        mapping.clear()
        return True
    grid = mapping.grid
    if grid.width == 0 or len(name) > NAME_MAX:
        return False
    try:
        await dog.robot[MapLibrary].put(StoredMap(name, grid, dog.robot.clock.epoch()))
    except (RobotError, OSError) as error:
        log.warning("map %r was not saved: %s", name, error)
        return False
    dog.stored_map = name
    return True
