"""Memory used for loading kernels is given back, and everything still works."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from roboglot.kernels import _unwritten, loading, rest

WITHOUT_YAML = """
import importlib, sys
from concurrent.futures import ThreadPoolExecutor
from roboglot.kernels import loading
finders = len(sys.meta_path)
with loading():
    import numba
    print("yaml" in sys.modules)
    ThreadPoolExecutor().submit(importlib.import_module, "yaml").result()
    del sys.modules["yaml"]
import yaml
print(len(sys.meta_path) > finders)
"""
MAPS = """\
7f00-7f10 r-xp 00001000 08:01 7 /x/libllvmlite.so
Rss:                  40 kB
Private_Dirty:         0 kB
Anonymous:             0 kB
THPeligible:           0
VmFlags: rd ex mr mw me
7f10-7f20 r--p 00002000 08:01 7 /x/libllvmlite.so
Rss:                  20 kB
Private_Dirty:         8 kB
Anonymous:             8 kB
VmFlags: rd mr mw me
7f20-7f30 rw-p 00003000 08:01 7 /x/libllvmlite.so
Rss:                   4 kB
Private_Dirty:         0 kB
Anonymous:             0 kB
VmFlags: rd wr mr mw me
7f30-7f40 r-xp 00001000 08:01 8 /x/some.so/a_file
Rss:                  12 kB
Private_Dirty:         0 kB
Anonymous:             0 kB
VmFlags: rd ex mr mw me
7f40-7f50 r-xp 00009000 08:01 7 /x/libother.so.2
Rss:                   4 kB
Private_Dirty:         0 kB
Anonymous:             0 kB
VmFlags: rd ex mr mw me
7f50-7f60 r-xp 00009000 08:01 7 /x/libllvmlite.so
Rss:                   0 kB
Private_Dirty:         0 kB
Anonymous:             0 kB
VmFlags: rd ex mr mw me
"""


def test_only_unwritten_cells_are_given_back() -> None:
    assert list(_unwritten(MAPS)) == [(0x7F00, 0x7F10, 40 * 1024), (0x7F40, 0x7F50, 4 * 1024)]


@pytest.mark.skipif(sys.platform != "linux", reason="pages are counted by Linux")
def test_given_back_memory_is_there_again_when_needed() -> None:
    from numba import njit

    from roboglot.kernels.sweep import blur

    def compiled() -> int:
        return int(njit(lambda x: x + 1)(41))

    assert compiled() == 42  # LLVM is loaded now
    assert rest() > 10_000_000
    blurred = blur(np.ones(4), np.zeros(4, np.float32), 0.0, 0.5, 2.0)
    assert blurred.tolist() == [1.0] * 4
    assert compiled() == 42


def test_nothing_is_given_back_when_nothing_was_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    import roboglot.kernels.sweep

    asked = []
    monkeypatch.setattr("roboglot.kernels.rest", lambda: asked.append(True))
    with loading():
        pass
    assert not asked
    monkeypatch.delitem(sys.modules, roboglot.kernels.sweep.__name__)
    with loading():
        monkeypatch.setitem(sys.modules, "roboglot.kernels.sweep", roboglot.kernels.sweep)
    assert asked


def test_numba_is_loaded_without_yaml_which_others_find() -> None:
    """Numba would read a file of settings with it; another thread may need it at the same time."""
    found = subprocess.run([sys.executable, "-c", WITHOUT_YAML], stdout=subprocess.PIPE, text=True, check=True)
    assert found.stdout.split() == ["False", "False"]
