"""Tables of the groups' functions, and dispatch of a program's calls to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboglot.model.client_context import identity
from roboglot.model.errors import RobotError
from roboglot.operations import BadParameters, Operation, OperationTable, Right
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.worker.values import Record
from roboglot.validation import PYTHON

ABILITIES: OperationTable[str] = OperationTable("visual", Right.PROGRAM)
TIME: OperationTable[str] = OperationTable("time", Right.PROGRAM)  # Python's own module, on the robot's clock

ATTRIBUTES = (".state", ".data", ".params")  # read without calling
NO_ABILITIES = (*ATTRIBUTES, ".set_log")  # not abilities of the robot

# Names in the manual's examples that differ from its interface tables, and the firmware's keywords.
SPELLINGS = {
    "cyberdog.motion.stand_up": "cyberdog.motion.resume_standing",
    "cyberdog.stand_up": "cyberdog.motion.resume_standing",
    "cyberdog.get_down": "cyberdog.motion.get_down",
    "cyberdog.block": "cyberdog.task.block",
    "cyberdog.motion.lateral_movevment": "cyberdog.motion.lateral_movement",
    "cyberdog.navigation.turn_off_relocation": "cyberdog.navigation.turn_off_navigation",
}
KEYWORDS = {
    ("cyberdog.motion.go_straight", "velocity"): "x_velocity",
    ("cyberdog.motion.lateral_movement", "velocity"): "y_velocity",
    ("cyberdog.personnel.face_recognized", "names"): "personnel_ids",
    **{
        (f"cyberdog.motion.{walk}", keyword): name
        for walk in ("go_straight", "lateral_movement")
        for keyword, name in (("journey", "distance"), ("time", "duration"))
    },
}

JOINED = frozenset({"cyberdog.audio.play", "cyberdog.audio.instantly_play"})  # one of the examples passes several texts


async def call(session: Session, name: str, args: Sequence[object], kwargs: Mapping[str, object]) -> object:
    """Run the function that a program calls; keep its group's state.

    Raises errors for the program: TypeError for wrong arguments, NotImplementedError for functions of the manual that
    are not built yet, RobotError, ValueError.
    """
    if (timing := TIME.get(name)) is not None:
        return await timing.handler(session, **bind(timing, args, kwargs))
    operation = ABILITIES.get(SPELLINGS.get(name, name))
    if operation is None:
        raise NotImplementedError(f"{name} is not built yet")
    try:
        if session.robot.admission.enforced and identity():  # programs without a client's identity belong to the robot
            session.robot.admission.check("visual", operation.key, operation.right)
        result = await operation.run(session, bind(operation, args, kwargs))
    except RobotError as error:
        remember(session, operation.key, error)
        raise
    remember(session, operation.key, result)
    log_call(session, operation.key, args, kwargs, result)
    return result


def remember(session: Session, name: str, result: object) -> None:
    """Keep the state of the function's group: the State of its result, or FAIL for an error."""
    name = SPELLINGS.get(name, name)
    group = name.split(".")[-2]
    if isinstance(result, RobotError):
        session.states[group] = session.last_state = state(StateCode.FAIL, str(result))
    elif not name.endswith(NO_ABILITIES) and (outcome := state_of(result)) is not None:
        session.states[group] = outcome
        if group != "task":
            session.last_state = outcome


def log_call(session: Session, name: str, args: Sequence[object], kwargs: Mapping[str, object], result: object) -> None:
    """Write the call to the task's log if its group is logged."""
    if name.split(".")[-2] in session.logging and not name.endswith(NO_ABILITIES):
        given = ", ".join([*map(repr, args), *(f"{key}={value!r}" for key, value in kwargs.items())])
        outcome = state_of(result)
        said = outcome.fields["describe"] if outcome else "ok"
        session.host.write("call", f"{name}({given}): {said}")


def bind(operation: Operation[str], args: Sequence[object], kwargs: Mapping[str, object]) -> dict[str, object]:
    """Return the arguments by name, bound as in Python, of the declared types. Raises TypeError with Python's texts."""
    names = operation.names
    if operation.key in JOINED and len(args) > 1 and all(isinstance(arg, str) for arg in args):
        args = ["".join(map(str, args))]
    if len(args) > len(names):
        raise TypeError(f"{operation.key}() takes at most {len(names)} arguments but {len(args)} were given")
    values: dict[str, object] = dict(zip(names, args, strict=False))
    for keyword, value in kwargs.items():
        name = KEYWORDS.get((operation.key, keyword), keyword)
        if name not in names:
            raise TypeError(f"{operation.key}() got an unexpected keyword argument '{keyword}'")
        if name in values:
            raise TypeError(f"{operation.key}() got multiple values for argument '{name}'")
        values[name] = value
    kinds = operation.handler.__annotations__
    try:
        return operation.parse({n: _as_bound(value, kinds[n]) for n, value in values.items()}, PYTHON, strict=True)
    except BadParameters as error:
        raise TypeError(f"{operation.key}(): {error}") from None


def _as_bound(value: object, kind: str) -> object:
    """Return truth values as numbers and the reverse, as bindings of C++ functions do; they convert no text."""
    if isinstance(value, bool) and kind in ("int", "float"):
        return int(value)
    return bool(value) if isinstance(value, int) and kind == "bool" else value


def state_of(result: object) -> Record | None:
    """Return the State that a result is or contains; None without one."""
    match result:
        case Record(type="State"):
            return result
        case Record(fields={"state": Record(type="State") as found}):
            return found
    return None
