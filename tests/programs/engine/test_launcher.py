"""The zygote's start: who is called off in the middle of it leaves no process behind."""

from __future__ import annotations

import asyncio
import subprocess
import time

import pytest

from roboglot.programs.engine import launcher
from roboglot.programs.engine.launcher import Launcher


async def test_a_start_that_is_called_off_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    begin, started = launcher._start_process, list[subprocess.Popen[bytes]]()

    def slowly(descriptor: int, filter_required: bool) -> subprocess.Popen[bytes]:
        time.sleep(0.1)
        started.append(begin(descriptor, filter_required))
        return started[0]

    monkeypatch.setattr(launcher, "_start_process", slowly)
    opening = asyncio.create_task(Launcher(lambda _lost: None).open())
    await asyncio.sleep(0.02)
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    assert [process.returncode is not None for process in started] == [True]
