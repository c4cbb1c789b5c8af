"""Modules of other projects in PYTHONPATH do not stand in for libraries of ours."""

import os
import subprocess
import sys
from pathlib import Path


def test_command_runs_beside_modules_of_the_same_names(tmp_path: Path) -> None:
    for name in ("typer", "msgspec", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('not this one')\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "roboglot", "coverage", "--help"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
        timeout=180,
    )
    assert done.returncode == 0, done.stderr
