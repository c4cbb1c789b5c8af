"""The fork behind shards and warm starts: no signal is lost in it, and a child that cannot begin ends."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from roboglot.shards.warm_up import EXIT_BROKEN

# A parent that ignores SIGTERM, as the nursery does; its child is signalled before it has handlers of its own.
PARENT = """
import os, signal, sys
from roboglot.shards.warm_up import fork

def prepare():
    os.kill(os.getpid(), signal.SIGTERM)
    {prepare}

signal.signal(signal.SIGTERM, signal.SIG_IGN)
if (pid := fork(prepare)) == 0:
    os._exit(0)
assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == set()
print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
"""


@pytest.mark.parametrize(
    ("prepare", "status"),
    [
        ("signal.signal(signal.SIGTERM, signal.SIG_DFL)", -signal.SIGTERM),
        ("signal.signal(signal.SIGTERM, lambda *_: os._exit(7))", 7),
        ("raise BrokenPipeError", EXIT_BROKEN),
    ],
)
def test_a_signal_just_after_a_fork_is_heard(prepare: str, status: int) -> None:
    code = PARENT.format(prepare=prepare)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert int(done.stdout) == status
