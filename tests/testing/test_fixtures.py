"""The test kit works with nothing but the package: the start page's own example, in a separate folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import execnet
import pytest

import roboglot.fleet
from roboglot.hosting import installation
from roboglot.model.geometry import Pose
from roboglot.testing import assert_pose
from roboglot.testing.plugin import pytest_xdist_setupnodes
from tests.workers.warm_start import COLD

START = Path(__file__).parents[2] / "docs/start.md"


@pytest.mark.slow  # a test suite of its own
def test_start_pages_example_passes_in_an_empty_folder(tmp_path: Path) -> None:
    [example] = [block for block in re.findall(r"```python\n(.*?)```", START.read_text(), re.S) if "def test_" in block]
    (tmp_path / "test_example.py").write_text(example)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)]
    cold = os.environ | {COLD: "1"}  # as users have it
    done = subprocess.run(command, cwd=tmp_path, env=cold, capture_output=True, text=True, timeout=180, check=False)
    assert "1 passed" in done.stdout, done.stdout + done.stderr


def test_pytest_does_not_rewrite_the_asserts_of_roboglot() -> None:
    assert type(roboglot.fleet.__loader__).__module__ != "_pytest.assertion.rewrite"
    assert type(sys.modules[__name__].__loader__).__module__ == "_pytest.assertion.rewrite"


def test_workers_that_start_warm_keep_their_names(monkeypatch: pytest.MonkeyPatch) -> None:
    """xdist named them anew, and spoke of twice as many."""
    monkeypatch.setenv(installation.WARM, "1")
    given = execnet.XSpec("popen")
    given.id = "gw0"
    specs: list[object] = [given]
    pytest_xdist_setupnodes(specs)
    [warm] = specs
    assert isinstance(warm, execnet.XSpec)
    assert (warm.id, warm.popen, "roboglot.cli.warm" in str(warm.python)) == ("gw0", True, True)


def test_a_pose_that_is_off_is_reported() -> None:
    assert_pose(Pose(1, 2, 0.01), x=1.02, y=2, deg=0)
    with pytest.raises(AssertionError, match=r"x is 1\.000, not 1\.100; yaw is 90\.0, not 0\.0 degrees"):
        assert_pose(Pose(1, 2, 1.5707963), x=1.1, y=2, deg=0)
