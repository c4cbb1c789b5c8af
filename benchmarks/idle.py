"""Claim: ready in <= 2 s on a warm start, <= 0.15 core and <= 300 MB while idle with all doors up; stops within 1 s."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from roboglot.testing.process import served

SECONDS = 10.0


def row(name: str, value: float, limit: float, unit: str) -> None:
    print(f"{name:28} {value:8.2f} {unit:5} limit {limit:g} {unit}  ratio {value / limit:.2f}")


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        with served(data, *sys.argv[1:], address="127.0.0.21"):
            pass  # the first start makes certificates and caches
        starts = []
        for _ in range(3):
            with served(data, *sys.argv[1:], address="127.0.0.21") as robot:
                starts.append(robot.ready_after)
        with served(data, *sys.argv[1:], address="127.0.0.21") as robot:
            time.sleep(5)
            used, began = robot.cpu_seconds, time.monotonic()
            time.sleep(SECONDS)
            share = (robot.cpu_seconds - used) / (time.monotonic() - began)
            memory = robot.resident_megabytes
            began = time.monotonic()
            robot.process.terminate()
            robot.process.wait()
            stopped = time.monotonic() - began
    row("warm start to ready", sorted(starts)[1], 2.0, "s")
    row("idle", share, 0.15, "core")
    row("memory", memory, 300, "MB")
    row("SIGTERM to end", stopped, 1.0, "s")


if __name__ == "__main__":
    main()
