"""Reading, setting and following the robot's parameters."""

from __future__ import annotations

import msgspec

from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.foxglove.context import Context
from roboglot.protocols.foxglove.table import TABLE
from roboglot.protocols.foxglove.vocabulary import DOOR, PARAMETERS, Parameter, parameters
from roboglot.wire.foxglove.messages import message

NAMES_MAX = 200


class Value(msgspec.Struct):
    """A parameter and its value."""

    name: str
    value: object = None


@TABLE.on("getParameters", right=Right.SEE)
async def get_parameters(context: Context, *, parameter_names: list[str] | None = None, id: str | None = None) -> None:
    """Return the named parameters that the robot has; without names, all."""
    names = _checked(parameter_names or [])
    context.send(message("parameterValues", parameters=parameters(context.robot, names), id=id))


@TABLE.on("setParameters", right=Right.SEE)
async def set_parameters(context: Context, *, parameters: list[Value], id: str | None = None) -> None:
    """Set parameters, each with its own right; with an ``id``, return their new values."""
    names = _checked([value.name for value in parameters])
    try:
        for value in parameters:
            await _set(context.robot, value)
    finally:
        if id is not None:
            context.send(message("parameterValues", parameters=_present(context.robot, names), id=id))
        context.report_parameters()


@TABLE.on("subscribeParameterUpdates", right=Right.SEE)
async def follow_parameters(context: Context, *, parameter_names: list[str] | None = None) -> None:
    """Send parameters whenever they change, appear or go; without names, all."""
    wanted = _checked(parameter_names or []) or PARAMETERS
    names = [name for name in wanted if name in PARAMETERS]
    context.watched.update(dict.fromkeys(names))
    context.watched.update((str(row["name"]), row["value"]) for row in _present(context.robot, names))


@TABLE.on("unsubscribeParameterUpdates", right=Right.SEE)
async def unfollow_parameters(context: Context, *, parameter_names: list[str] | None = None) -> None:
    """Stop sending parameters; without names, all."""
    for name in _checked(parameter_names or []) or list(context.watched):
        context.watched.pop(name, None)


def _checked(names: list[str]) -> list[str]:
    if len(names) > NAMES_MAX:
        raise InvalidGoal(f"more than {NAMES_MAX} parameters")
    return names


def _present(robot: Robot, names: list[str]) -> list[dict[str, object]]:
    return parameters(robot, names) if names else []


async def _set(robot: Robot, value: Value) -> None:
    parameter: Parameter | None = PARAMETERS.get(value.name)
    if parameter is None:
        raise NotFound(f"there is no parameter {value.name[:80]!r}")
    if parameter.write is None:
        raise InvalidGoal(f"{value.name} is read-only")
    robot.admission.check(DOOR, f"set {value.name}", parameter.right)
    try:
        wanted: object = msgspec.convert(value.value, parameter.kind)
    except msgspec.ValidationError:
        raise InvalidGoal(f"{value.name} is {'a number' if parameter.kind is float else 'true or false'}") from None
    if (storing := parameter.write(robot, wanted)) is not None:
        await storing
