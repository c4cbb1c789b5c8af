"""Chapter "motion": strategies, named ways to move. The manual only knows "default"; "careful" is ours."""

from __future__ import annotations

from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE, Text
from roboglot.wire.slamware.chapters.motion import Strategy

API = "/api/core/motion/v1/strategies"
CURRENT = "slamware.strategy"  # the setting
SHARES = {"default": 1.0, "careful": 0.5}  # of the speed of every drive that a client starts


def speed_share(robot: Robot) -> float:
    """Return the share of the speed under the current strategy."""
    return SHARES.get(_current(robot), 1.0)


def _current(robot: Robot) -> str:
    return str(robot[Settings].get(CURRENT, "default")) if Settings in robot else "default"


@TABLE.on(f"GET {API}", right=Right.SEE, needs=(Navigation,))
def get_motion_strategies(context: Context) -> list[str]:
    """Return all strategies."""
    context.robot.require(Navigation)
    return list(SHARES)


@TABLE.on(f"GET {API}/:current", right=Right.SEE, needs=(Navigation,))
def get_current_strategy(context: Context) -> Text:
    """Return the current strategy."""
    context.robot.require(Navigation)
    return Text(_current(context.robot))


@TABLE.on(f"PUT {API}/:current", right=Right.EDIT, needs=(Navigation, Settings))
async def set_current_strategy(context: Context, body: Strategy) -> bool:
    """Set the strategy of further actions, kept over restarts; 400 for an unknown name."""
    if body.strategy not in SHARES:
        raise InvalidGoal(f"there is no strategy {body.strategy}")
    context.robot.require(Navigation)
    await context.robot[Settings].put(CURRENT, body.strategy)
    return True
