"""A real ``roboglot up`` in its own process, for end-to-end tests, benchmarks and the demo."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from roboglot.values import dataclass

READY_SECONDS_MAX = 60.0
STOP_SECONDS_MAX = 10.0
CHILD_SECONDS_MAX = 60.0


class NotUp(RuntimeError):
    """The robot did not come up; the message ends with its log."""


@dataclass(frozen=True, slots=True)
class ServedRobot:
    """A running roboglot: process, data folder, first address, and start time until ready (s)."""

    process: subprocess.Popen[str]
    data: Path
    address: str
    ready_after: float

    @property
    def cpu_seconds(self) -> float:
        """Processor time used so far (s), all threads, without children."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / 100

    @property
    def resident_megabytes(self) -> float:
        """Resident memory (MiB)."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.partition("VmRSS:")[2].split()[0]) / 1024


@contextlib.contextmanager
def served(
    data: Path, *arguments: str, address: str = "127.0.0.1", log: Path | None = None, module: str = "roboglot"
) -> Iterator[ServedRobot]:
    """Start ``roboglot up`` (or ``module``), wait for its ``ready``, stop it at the end. Raises NotUp with its log."""
    log = log or data.with_name(f"{data.name}.log")
    log.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", module, "up", "--data", str(data), "--address", address, *arguments]
    began = time.monotonic()
    with (
        log.open("w") as output,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=output, stdin=subprocess.PIPE, text=True) as process,
    ):
        try:
            _wait_until_ready(process, log)
            yield ServedRobot(process, data, address, time.monotonic() - began)
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(STOP_SECONDS_MAX)
            except subprocess.TimeoutExpired:
                process.kill()


@contextlib.contextmanager
def child(code: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run ``code`` in a Python process with its output in a pipe. Killed at the end or after ``CHILD_SECONDS_MAX``.

    So reading its output ends by then, even if it fails.
    """
    command = [sys.executable, "-c", code, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        patience = threading.Timer(CHILD_SECONDS_MAX, process.kill)
        patience.start()
        try:
            yield process
        finally:
            patience.cancel()
            process.kill()


def _wait_until_ready(process: subprocess.Popen[str], log: Path) -> None:
    assert process.stdout
    patience = threading.Timer(READY_SECONDS_MAX, process.kill)
    patience.start()
    try:
        for line in process.stdout:
            if line.strip() == "ready":
                return
    finally:
        patience.cancel()
    raise NotUp(f"roboglot did not come up:\n{log.read_text()}")
