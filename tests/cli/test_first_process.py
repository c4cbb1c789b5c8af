"""As process 1 of a container, a command ends at SIGTERM even while it is being loaded."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

LOADING = """
import os, signal, sys

class Slow:
    def find_spec(self, name, path, target=None):
        if name == "roboglot.cli":
            print("loading", flush=True)
            signal.pause()

sys.meta_path.insert(0, Slow())
from roboglot.__main__ import run
run()
"""


@pytest.mark.skipif(os.geteuid() != 0 or not shutil.which("unshare"), reason="needs root and unshare")
def test_a_first_process_that_loads_ends_at_sigterm() -> None:
    command = ["unshare", "--pid", "--fork", "--kill-child", sys.executable, "-c", LOADING]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        if process.stdout.readline() != "loading\n":
            pytest.skip("no process namespaces here")
        try:
            first = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
            os.kill(int(first), signal.SIGTERM)
            assert process.wait(20) == 128 + signal.SIGTERM
        finally:
            process.kill()
