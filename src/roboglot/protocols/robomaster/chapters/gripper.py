"""The gripper chapter (manual 3.2.14)."""

from __future__ import annotations

from roboglot.model.components.motion.gripper import Gripper
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import Level
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.vocabulary import GRIPPER, GRIPPER_OF_ROBOTS


@TABLE.on("robotic_gripper open", right=Right.DRIVE, needs=(Gripper,))
def open_(context: Context, level: Level = 1) -> None:
    """Open the jaws; ``open 1``, ``open leve 1`` and ``open level 1`` are equivalent (3.2.14.1). Answers at once."""
    context.robot[Gripper].open(level, source=context.source)


@TABLE.on("robotic_gripper close", right=Right.DRIVE, needs=(Gripper,))
def close(context: Context, level: Level = 1) -> None:
    """Close the jaws until they meet or hold something; a higher level is faster and stronger (3.2.14.2)."""
    context.robot[Gripper].close(level, source=context.source)


@TABLE.on("robotic_gripper stop", right=Right.DRIVE, needs=(Gripper,))
def stop(context: Context) -> None:
    """Stop the jaws; in no manual, but real robots know it."""
    context.robot[Gripper].stop()


@TABLE.on("robotic_gripper status ?", right=Right.SEE, needs=(Gripper,))
def get_status(context: Context) -> tuple[int, ...]:
    """Return 0 closed, 1 between, 2 open (3.2.14.3); real robots: 0 between, 1 open, 2 closed."""
    return ((GRIPPER_OF_ROBOTS if context.profile.as_robots else GRIPPER)[context.robot[Gripper].status],)
