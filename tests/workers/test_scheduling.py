"""A worker that crashes costs the test it crashed in, and no other."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILE = """
import os

def test_first(): pass
def test_second(): {second}
def test_third(): pass
"""
LATE = """
import os, pathlib, time

WORKER, BEGUN = os.environ.get("PYTEST_XDIST_WORKER"), pathlib.Path(__file__).with_name("begun")

def pytest_collection_modifyitems():
    last = time.monotonic() + 20
    while WORKER == "gw3" and not BEGUN.exists() and time.monotonic() < last:
        time.sleep(0.01)

def pytest_runtest_setup():
    if WORKER == "gw2":
        BEGUN.touch()
"""


@pytest.mark.parametrize(
    ("workers", "crashing"), [pytest.param(1, (1, 4), marks=pytest.mark.slow), (2, (1, 4)), (2, (0, 1))]
)
def test_workers_that_crash_cost_one_test_each(workers: int, crashing: tuple[int, int], tmp_path: Path) -> None:
    """Of two that crash at nearly the same time, one replacement runs tests while the other still collects them."""
    (tmp_path / "conftest.py").write_text(LATE)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    for number in range(6):
        second = "os._exit(1)" if number in crashing else "pass"
        (tmp_path / f"test_{number}.py").write_text(FILE.format(second=second))
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "xdist",
        "-p",
        "tests.workers.scheduling",
        "-n",
        str(workers),
    ]
    done = subprocess.run(
        [*command, "-n", str(workers), "--dist", "loadfile", "--no-loadscope-reorder", str(tmp_path)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert "2 failed, 16 passed" in done.stdout, done.stdout + done.stderr
    assert "crashed while running 'test_1.py::test_second'" in done.stdout
