"""Chapter "charging": docking as a task of 6004; the dock of the stored map."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import replace

from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.motion.docking import Docking
from roboglot.model.errors import RobotError
from roboglot.model.map_loading import known_dock
from roboglot.protocols.cyberdog.chapters.mapping.task_state import Task
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.context import Context
from roboglot.wire.cyberdog.codes import Feedback, TaskResult

log = logging.getLogger(__name__)
MOVED = 0.05  # m from the dock's place on the stored map beyond which the map is stored again


async def dock(context: Context, task: Task) -> TaskResult:
    """Drive onto the charging contacts; the manual leaves the feedback open, real robots send these two.

    A dock at an unknown place is searched nearby. ``feedback_msg`` gives the reason why the robot does not charge.
    """
    task.feedback(Feedback.ACTIVATING)
    try:
        action = task.action = context.robot[Docking].dock(source=SOURCE)
        task.feedback(Feedback.DOCKING)
        try:
            await action.succeeded()
        except asyncio.CancelledError:
            action.cancel("the door closes")
            raise
    except RobotError as error:
        return task.fail(Feedback.DOCKING, error)
    await keep_dock(context)
    return TaskResult.SUCCESS


async def keep_dock(context: Context) -> None:
    """Store the learnt place of the dock with the map in use."""
    robot = context.robot
    if not context.stored_map or (home := known_dock(robot)) is None:
        return

    def edit(stored: StoredMap) -> StoredMap:
        known = stored.dock is not None and stored.dock.distance_to(home) <= MOVED
        return stored if known else replace(stored, dock=home)

    try:
        await robot[MapLibrary].modify(context.stored_map, edit)
    except (RobotError, OSError) as error:
        log.warning("cannot store the dock of map %r: %s", context.stored_map, error)
