"""Each domain error of programs has a number of the protocol."""

from __future__ import annotations

from roboglot.programs import errors
from roboglot.programs.functions.results import StateCode
from roboglot.programs.tasks.reports import TaskReport
from roboglot.programs.tasks.states import TaskOperation
from roboglot.protocols.visual.errors import STATES, state_of, state_of_report
from roboglot.wire.visual.codes import FeedbackState


def test_every_domain_error_has_a_number() -> None:
    concrete = {
        error
        for error in vars(errors).values()
        if isinstance(error, type) and issubclass(error, Exception) and error is not errors.ProgramError
    }
    assert concrete == set(STATES)


def test_success_and_unknown_errors_have_numbers() -> None:
    assert state_of(None) is FeedbackState.OK
    assert state_of(ZeroDivisionError("x")) is FeedbackState.OTHER


def test_block_reports_carry_the_ability_status() -> None:
    report = TaskReport("t", TaskOperation.RUN, "run task", block=("end", "b"), block_status=StateCode.FAIL)
    assert state_of_report(report) == int(StateCode.FAIL)
    failed = TaskReport("t", TaskOperation.RUN, "no", errors.CannotExecute("no"))
    assert state_of_report(failed) == FeedbackState.CANNOT_EXECUTE
