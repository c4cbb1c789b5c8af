"""The protocol's error codes (0.2.1.2.2.1 of the manual): domain errors in, ``feedback.state`` out."""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.programs import errors
from roboglot.programs.tasks.reports import TaskReport
from roboglot.wire.visual.codes import FeedbackState

STATES: Mapping[type[Exception], FeedbackState] = {
    errors.NotAllowed: FeedbackState.ILLEGAL,
    errors.LimitReached: FeedbackState.CANNOT_REGISTER,
    errors.InvalidCondition: FeedbackState.BAD_CONDITION,
    errors.InvalidBody: FeedbackState.BAD_BODY,
    errors.ProgramProblems: FeedbackState.BAD_SYNTAX,
    errors.RecursiveModule: FeedbackState.BAD_REQUEST,
    errors.ModuleGone: FeedbackState.INTERRUPTED,
    errors.CannotExecute: FeedbackState.CANNOT_EXECUTE,
    errors.EngineTimeout: FeedbackState.TIMED_OUT,
    errors.EngineUnavailable: FeedbackState.OTHER,
    errors.StoreError: FeedbackState.CANNOT_UPDATE_LIST,
}


def state_of(error: Exception | None) -> FeedbackState:
    """Return the code of an error; OK for None, OTHER for an error that the manual does not list."""
    return FeedbackState.OK if error is None else STATES.get(type(error), FeedbackState.OTHER)


def state_of_report(report: TaskReport) -> int:
    """Return the code of a report: for blocks the last ability call's StateCode, otherwise a FeedbackState."""
    return int(state_of(report.error) if report.block is None else report.block_status)
