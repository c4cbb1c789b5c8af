"""Results of calls that the end of the server interrupted; such a call is not repeated.

Each function reports failures in its own type of result, so it runs with a robot that fails at every use, and its
failure becomes one that leaves the robot's progress open. Knows no process and no journal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NoReturn, cast

from roboglot.model.admission import Admission
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import SPELLINGS, call, log_call, remember, state_of
from roboglot.programs.worker.values import Record


class CallInterrupted(RobotError):
    """The server ended during the call; the robot's progress is not known."""


class _OutOfReach:
    """Stand-in for a robot out of reach: every use raises ``error``, for every client."""

    admission = Admission()

    def __init__(self, error: CallInterrupted) -> None:
        self._error = error

    def __getattr__(self, name: str) -> NoReturn:
        raise self._error

    def __getitem__(self, interface: type) -> NoReturn:
        raise self._error

    def __contains__(self, interface: type) -> bool:
        raise self._error


async def call_cut_off(session: Session, name: str, args: Sequence[object], kwargs: Mapping[str, object]) -> object:
    """Return the function's result with the failing state SPIN_FUTURE_INTERRUPTED; success if it needs no robot.

    Raises CallInterrupted for a result without a state, and like ``call`` for wrong arguments.
    """
    error = CallInterrupted(f"the server ended while {name} was under way; it was not repeated")
    elsewhere = Session(cast(Robot, _OutOfReach(error)), session.task, session.host)
    try:
        result = await call(elsewhere, name, args, kwargs)
    except RobotError:
        result = None
    found, outcome = state_of(result), state(StateCode.SPIN_FUTURE_INTERRUPTED, str(error))
    if found is None or not isinstance(result, Record):
        remember(session, name, error)
        raise error
    if found.fields["code"] != StateCode.SUCCESS:  # the robot's own refusal already has a code
        result = outcome if result is found else Record(result.type, {**result.fields, "state": outcome})
    remember(session, name, result)
    log_call(session, SPELLINGS.get(name, name), args, kwargs, result)
    return result
