"""Host of a run's functions: its blocks, its breakpoints and its log."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from roboglot.programs.functions.results import StateCode
from roboglot.programs.functions.session import Session
from roboglot.programs.tasks.reports import Report, TaskReport
from roboglot.programs.tasks.run_log import RunLog
from roboglot.programs.tasks.states import TaskOperation


class RunHost:
    """The ``Host`` of one run's ``session``. Reports begin and end of blocks to ``report``, always alternating."""

    session: Session

    def __init__(self, task: str, log: RunLog, report: Report, at_breakpoint: Callable[[], Awaitable[None]]) -> None:
        self._task, self._log, self._report, self._at_breakpoint = task, log, report, at_breakpoint
        self._block: str | None = None

    @property
    def block(self) -> str:
        """Id of the open block, "" for none."""
        return self._block or ""

    def restore_block(self, id: str) -> None:
        """Restore the block that was open when the run was interrupted."""
        self._block = id

    def begin_block(self, id: str) -> None:
        """End the open block and begin this one (0.2.1.2.2.2)."""
        self.end_block()
        self._block = id
        self._report_block("begin", id)

    def end_block(self) -> None:
        """End the open block, if any."""
        if self._block is not None:
            self._report_block("end", self._block)
            self._block = None

    async def breakpoint(self) -> None:
        """Suspend the program at a breakpoint."""
        await self._at_breakpoint()

    def write(self, level: str, text: str) -> None:
        """Add a function's message to the log."""
        self._log.write(level, text)

    def _report_block(self, kind: str, id: str) -> None:
        last = self.session.last_state.fields
        code = last["code"]
        words = "run task" if code == StateCode.SUCCESS else f"run task. {last['describe']}"
        self._report(TaskReport(self._task, TaskOperation.RUN, words, block=(kind, id), block_status=StateCode(code)))
