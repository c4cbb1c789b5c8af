"""Causes of an end that the worker did not report itself."""

from __future__ import annotations

import signal

from roboglot.programs.engine.events import ExitReason
from roboglot.programs.engine.launcher import Death
from roboglot.programs.worker.link import EXIT_MEMORY

CPU_SHARE = 0.5
"""Part of the processor limit above which the limit is taken as the cause of a kill.

The kernel's limit counts whole ticks, the accounting does not: on a busy machine they differ by some tenths.
"""


def reason_of(death: Death, cpu_limit: float) -> tuple[ExitReason, str, str]:
    """Return the reason, the error's name and its message."""
    if death.status is None:
        return ExitReason.LOST, "EngineLost", "the program engine has ended"
    over_cpu = death.status == -signal.SIGKILL and death.cpu >= cpu_limit * CPU_SHARE
    if death.status == -signal.SIGXCPU or over_cpu:
        return ExitReason.CPU, "CpuLimit", f"the program used more than {cpu_limit} s of processor time"
    if death.status == EXIT_MEMORY:
        return ExitReason.MEMORY, "MemoryError", "the program used more memory than it may"
    how = f"signal {-death.status}" if death.status < 0 else f"exit code {death.status}"
    return ExitReason.CRASHED, "Crashed", f"the program's process ended unexpectedly ({how})"
