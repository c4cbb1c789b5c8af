"""Processes that stand in for those that Ray starts."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from subprocess import PIPE


@contextmanager
def child(name: str) -> Iterator[subprocess.Popen[str]]:
    """A process of this name, as one that Ray has started from this program."""
    work = f"open('/proc/self/comm', 'w').write({name!r}); print(flush=True); input()"
    with subprocess.Popen([sys.executable, "-Sc", work], stdin=PIPE, stdout=PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "\n"
        try:
            yield process
        finally:
            process.kill()
