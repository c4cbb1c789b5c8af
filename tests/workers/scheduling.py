"""Sharing of tests among workers, which may crash."""

from __future__ import annotations

import contextlib
import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from xdist.workermanage import WorkerController

ROOT = Path(__file__).parents[2]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> object:
    """Share tests out by files; called by xdist."""
    from xdist.scheduler import LoadFileScheduling

    class FileScheduling(LoadFileScheduling):
        """Has one worker start the browser, one PostgreSQL, and one parse all sources. Outlives its workers' crashes.

        xdist 3.8 deals completed tests out again after a crash, and waits forever for their worker (its issues 1323,
        1327 and 1378).
        """

        def _split_scope(self, nodeid: str) -> str:
            return _companion_of(nodeid.partition("::")[0]) or super()._split_scope(nodeid)

        def remove_node(self, node: WorkerController) -> str | None:
            """Return the test that a worker crashed in, if it did; its later ones are dealt out again."""
            work = self.assigned_work.pop(node)
            left = [(scope, test) for scope, tests in work.items() for test, ended in tests.items() if not ended]
            if not left:
                return None
            (_, crashed), *later = left
            for scope, test in later:
                self.workqueue.setdefault(scope, {})[test] = False
            for other in self.nodes:
                self._reschedule(other)
            return crashed

        def _assign_work_unit(self, node: WorkerController) -> None:
            with contextlib.suppress(OSError):  # it has just crashed; remove_node follows
                super()._assign_work_unit(node)

        def _reschedule(self, node: WorkerController) -> None:
            if node not in self.registered_collections:
                return  # it replaces one that crashed, and gets tests when it has collected them
            super()._reschedule(node)
            if not node.shutting_down and self._pending_of(self.assigned_work[node]) < 2:
                self._reschedule(node)  # a worker begins no test before it has the next, or is to end

    return FileScheduling(config, log) if config.getoption("dist") == "loadfile" else None


@functools.cache
def _companion_of(file: str) -> str:
    """Return the folder whose server a file of tests needs, or the file whose syntax trees; or ""."""
    if file == "tests/console/test_server_words.py":
        return "tests/test_house.py"
    for folder in ("tests/browser", "tests/storage"):
        if file.startswith(f"{folder}/"):
            return folder
    path = ROOT / file
    return "tests/storage" if path.is_file() and "db_server" in path.read_text(encoding="utf-8") else ""
