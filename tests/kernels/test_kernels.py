"""Loading kernels: nothing until asked for."""

from __future__ import annotations

import subprocess
import sys

from roboglot.kernels.ahead import missing


def test_importing_the_package_imports_no_compiler() -> None:
    code = "import sys, roboglot.kernels, roboglot.autonomy; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=100).returncode == 0


def test_compiled_kernels_are_not_compiled_again() -> None:
    command = [sys.executable, "-m", "roboglot.kernels"]
    subprocess.run(command, check=True, capture_output=True, timeout=200)
    again = subprocess.run(command, check=True, capture_output=True, text=True, timeout=100)
    assert again.stdout == ""
    assert missing() == []
