"""Chapter "motion", POST actions beyond the manual: the jack, and transport of its load."""

from __future__ import annotations

import msgspec

from roboglot.model.actions import Action
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.mapping.mapping import abort_with_map
from roboglot.model.components.motion.base import Base
from roboglot.model.errors import InvalidGoal
from roboglot.protocols.slamware.chapters.motion.errands import PART, Errand, run_errand
from roboglot.protocols.slamware.chapters.motion.moves import navigate
from roboglot.protocols.slamware.chapters.motion.tags import pose_of_target
from roboglot.protocols.slamware.context import Context
from roboglot.wire.slamware.chapters.motion import JackMoveOptions, JackTopMoveToOptions, JackTopWishes, MoveOptions


def move_jack(context: Context, options: JackMoveOptions) -> Action:
    """Raise or lower the jack."""
    jack = context.robot[Jack]

    async def work(errand: Errand) -> None:
        up = options.move_direction == "Up"
        await errand.do(jack.raise_platform(source=PART) if up else jack.lower_platform(source=PART))

    return run_errand(context.robot, "move jack", work, options.move_direction)


def carry(context: Context, options: JackTopMoveToOptions) -> Action:
    """Lift the shelf above the robot, unless lifted already, and carry it through the targets."""
    robot, wishes = context.robot, options.modify_params_move_options or JackTopWishes()
    targets = options.targets or ([options.target] if options.target else [])
    if not targets:
        raise InvalidGoal("give a target or targets")
    goals = [pose_of_target(robot, target).point for target in targets]
    how = wishes.move_options or MoveOptions()
    if wishes.robot_line_speed:
        share = min(wishes.robot_line_speed / robot[Base].limits.twist.x, 1.0)
        how = msgspec.structs.replace(how, speed_ratio=share)

    async def work(errand: Errand) -> None:
        if robot[Jack].stage is not JackStage.UP:
            await errand.do(robot[Jack].raise_platform(source=PART))
        await errand.do(navigate(robot, goals, how, source=PART))

    return abort_with_map(robot, run_errand(robot, "carry", work, tuple(goals)))
