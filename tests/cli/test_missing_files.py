"""Commands name a file that is not there, in plain words."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.parametrize(
    "words",
    [
        ("record", "info", "no.mcap"),
        ("record", "repair", "no.mcap", "new.mcap"),
        ("replay", "no.mcap", "--against", "slamware://127.0.0.1"),
        ("compare", "no.mcap", "other.mcap"),
        ("rerun", "no.mcap"),
        ("program", "run", "no.mcap"),
        ("up", "--config", "no.mcap"),
        ("test", "no.mcap"),
        ("map", "build", "no.mcap", "--out", "new.yaml"),
    ],
)
def test_missing_file_is_named(words: tuple[str, ...], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "roboglot", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    assert done.returncode
    assert done.stderr.strip() == f"roboglot {words[0]}: no.mcap: No such file or directory"
