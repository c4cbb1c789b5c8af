"""Encoders and kernels are loaded when someone looks, not before: a start stays quick."""

from __future__ import annotations

import subprocess
import sys


def test_building_robots_loads_no_encoder_and_no_compiler() -> None:
    code = (
        "import sys, roboglot.fleet, roboglot.media.streams; sys.exit(any(m in sys.modules for m in ('av', 'numba')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=100).returncode == 0
