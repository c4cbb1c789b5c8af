"""Work beside the event loop."""

import asyncio
import gc
import importlib
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from roboglot.model.background import load

ENDS = """
import asyncio, threading
from roboglot.model.background import load

async def main():
    loading = asyncio.ensure_future(load(threading.Event().wait))  # an import that never ends
    await asyncio.sleep(0)

asyncio.run(main())
"""


def test_loading_does_not_hold_up_end_of_process() -> None:
    subprocess.run([sys.executable, "-c", ENDS], check=True, timeout=180)


async def test_loading_answers_from_another_thread() -> None:
    assert await load(threading.current_thread) is not threading.current_thread()


async def test_error_of_loading_is_raised_to_who_waits() -> None:
    with pytest.raises(ZeroDivisionError):
        await load(lambda: 1 / 0)


async def test_cancelled_loading_ends_without_a_word(caplog: pytest.LogCaptureFixture) -> None:
    go, gone = threading.Event(), threading.Event()

    def wait() -> None:
        go.wait()
        gone.set()

    loading = asyncio.ensure_future(load(wait))
    await asyncio.sleep(0)
    loading.cancel()
    go.set()
    assert await asyncio.to_thread(gone.wait, 10)
    with pytest.raises(asyncio.CancelledError):
        await loading
    assert not caplog.records


async def test_no_collection_walks_what_was_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "heavy_library.py").write_text("CYCLES = [[] for _ in range(40_000)]\n")
    monkeypatch.syspath_prepend(tmp_path)
    gc.freeze()
    before = gc.get_freeze_count()
    try:
        await load(lambda: importlib.import_module("heavy_library"))
        assert gc.get_freeze_count() - before > 20_000  # some frozen objects have ended meanwhile
        frozen = gc.get_freeze_count()
        await load(lambda: importlib.import_module("heavy_library"))
        assert gc.get_freeze_count() <= frozen, "what is not new leaves garbage to be collected"
    finally:
        gc.unfreeze()
        del sys.modules["heavy_library"]
