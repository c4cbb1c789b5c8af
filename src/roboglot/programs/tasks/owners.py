"""Rights of tasks that start at their scheduled time: those that their owner has at that moment."""

from __future__ import annotations

from roboglot.model.client_context import set_client
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.programs.errors import NotAllowed
from roboglot.programs.stores import StoredProgram


def act_for_owner(robot: Robot, task: StoredProgram) -> None:
    """Act for the task's owner from now on. Raises NotAllowed if the owner may no longer run programs."""
    set_client(f"visual {task.id}", identity=task.owner)
    if robot.admission.enforced and task.owner and not robot.admission.may(Right.PROGRAM):
        raise NotAllowed(f"{task.owner} may no longer run programs")
