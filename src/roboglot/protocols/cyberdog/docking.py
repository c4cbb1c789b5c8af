"""Chapter "charging": going home to the dock as a task of 6004."""

from __future__ import annotations

import asyncio

from roboglot.model.actions import ActionStatus
from roboglot.model.components.docking import Docking
from roboglot.protocols.cyberdog.dog import Dog
from roboglot.protocols.cyberdog.gait import SOURCE
from roboglot.protocols.cyberdog.task import Task
from roboglot.wire.cyberdog.codes import Feedback, TaskResult


async def dock(dog: Dog, task: Task) -> TaskResult:
    """Drive onto the charging contacts; the text leaves the feedback open, robots in the field send these two."""
    task.feedback(Feedback.ACTIVATING)
    action = task.action = dog.robot[Docking].dock(source=SOURCE)
    task.feedback(Feedback.DOCKING)
    try:
        status = await action.done()
    except asyncio.CancelledError:
        action.cancel("the door closes")
        raise
    return TaskResult.SUCCESS if status is ActionStatus.SUCCEEDED else TaskResult.FAILED
