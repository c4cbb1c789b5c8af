"""The heap of a process that hosts robots: what each scan takes and frees stays there, large maps go back."""

from __future__ import annotations

import ctypes
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


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="only glibc, from 2.33 on, counts its blocks")
def test_blocks_of_a_scan_stay_in_the_heap() -> None:
    ran = subprocess.run([sys.executable, "-c", TURNS], check=True, timeout=100, capture_output=True, text=True)
    beside, given_back, large_beside, _ = map(int, ran.stdout.split())
    assert (beside, given_back) == (0, 0)
    assert large_beside == 4  # each goes back to the kernel as it is freed
