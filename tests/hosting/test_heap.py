"""The heap of a process that hosts robots: what each scan takes and frees stays there, large maps go back."""

from __future__ import annotations

import subprocess
import sys

import pytest

TURNS = """
import resource, sys
import numpy as np
from roboglot.hosting.process import prepare
prepare()
def faults(size):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(50):
        np.ones(size // 8)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
faults(400_000)  # the heap grows once
print(faults(400_000), faults(2_000_000))  # less than a huge page
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other C libraries lack mallopt")
def test_blocks_of_a_scan_stay_in_the_heap() -> None:
    ran = subprocess.run([sys.executable, "-c", TURNS], check=True, timeout=100, capture_output=True, text=True)
    small, large = map(int, ran.stdout.split())
    assert small < 50  # pages
    assert large > 50 * 100
