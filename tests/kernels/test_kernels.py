"""Loading kernels: nothing until asked for."""

from __future__ import annotations

import subprocess
import sys

from roboglot import kernels


def test_importing_the_package_imports_no_compiler() -> None:
    code = "import sys, roboglot.kernels, roboglot.autonomy; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=100).returncode == 0


def test_compiling_ahead_tells_every_module() -> None:
    result = subprocess.run(
        [sys.executable, "-m", "roboglot.kernels"], check=True, capture_output=True, text=True, timeout=100
    )
    assert [line.split()[1] for line in result.stdout.splitlines()] == list(kernels.MODULES)
