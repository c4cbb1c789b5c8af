"""The process that hosts robots: what each scan takes and frees stays in its heap, large maps go back; its threads."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys

import pytest

TURNS = """
import ctypes
import numpy as np
from roboglot.hosting.process import prepare
class Info(ctypes.Structure):
    _fields_ = [(f"field_{number}", ctypes.c_size_t) for number in range(10)]  # heap's bytes, ..., blocks beside it
mallinfo = ctypes.CDLL(None).mallinfo2
mallinfo.restype = Info
def taken(size):
    before = mallinfo()
    blocks = [np.ones(size // 8) for _ in range(4)]
    most = mallinfo()
    del blocks
    return most.field_3 - before.field_3, most.field_0 - mallinfo().field_0
prepare()
print(*taken(400_000), *taken(2_000_000))
"""

THREADS = """
import os, sys
import roboglot.cli.up
assert "numpy" not in sys.modules
roboglot.cli.up.prepare()
import numpy
print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="only glibc, from 2.33 on, counts its blocks")
def test_blocks_of_a_scan_stay_in_the_heap() -> None:
    ran = subprocess.run([sys.executable, "-c", TURNS], check=True, timeout=100, capture_output=True, text=True)
    beside, given_back, large_beside, _ = map(int, ran.stdout.split())
    assert (beside, given_back) == (0, 0)
    assert large_beside == 4  # each goes back to the kernel as it is freed


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
def test_numpy_starts_no_threads() -> None:
    """OpenBLAS makes one for each processor, and each turns in a circle for the first tenth of a second."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("OPENBLAS_", "OMP_"))}
    ran = subprocess.run(
        [sys.executable, "-c", THREADS], check=True, timeout=100, capture_output=True, text=True, env=environment
    )
    assert ran.stdout.strip() == "1"
