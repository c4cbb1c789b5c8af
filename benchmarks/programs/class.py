"""Claims: 25 worlds ready in <= 6 s and 1.6 GB, each at real time with a polled robot; a killed one is back in 1 s.

One command starts them: `roboglot fleet up --worlds 25 --robots-each 1`. Memory is the processes' share (PSS) of the
machine's, nursery and supervisor included. The reference in the same run: one `roboglot up`, its start and memory.
`--worlds 10 --robots-each 100` asks for a thousand robots that stand, at >= 1 x real time.

    scripts/bench class [--worlds 25] [--robots-each 1] [--seconds 10]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from _claim import Claims

from roboglot.hosting import local_socket
from roboglot.shards.requests import SOCKET
from roboglot.testing.process import served

FIRST = "127.78.1.1"
PATIENCE = 300.0
POLLS = 10.0  # Hz, per polled robot
MB = 1 << 20


def memory(pid: int) -> float:
    """Return a process's share of the machine's memory, MB."""
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1024
    return 0.0


def pose(address: str) -> float:
    """Ask a robot where it is; s until it has answered."""
    began = time.monotonic()
    with urllib.request.urlopen(f"http://{address}:1448/api/core/slam/v1/localization/pose", timeout=5.0) as answer:
        answer.read()
    return time.monotonic() - began


def look(folder: Path) -> dict[str, Any]:
    """Output of `roboglot fleet list --json`."""
    answer: dict[str, Any] = json.loads(asyncio.run(local_socket.ask(folder / SOCKET, b"{}", PATIENCE)))
    return answer


def polled(addresses: list[str], seconds: float) -> list[float]:
    """Poll each address; the answers' times."""

    def poll(address: str) -> list[float]:
        times, end = [], time.monotonic() + seconds
        while (due := time.monotonic()) < end:
            times.append(pose(address))
            time.sleep(max(0.0, due + 1 / POLLS - time.monotonic()))
        return times

    with ThreadPoolExecutor(len(addresses)) as pool:
        return [taken for times in pool.map(poll, addresses) for taken in times]


def back_after(folder: Path) -> float:
    """Kill the first shard; s until its robot answers again."""
    os.kill(look(folder)["shards"][0]["pid"], signal.SIGKILL)
    began = time.monotonic()
    time.sleep(0.02)  # the kernel removes its sockets
    while time.monotonic() - began < PATIENCE:
        try:
            pose(FIRST)
            return time.monotonic() - began
        except OSError:
            time.sleep(0.01)
    return PATIENCE


def reference(folder: Path) -> None:
    """One robot in a separate process."""
    with served(folder / "alone", address="127.78.200.1", log=folder / "alone.log") as robot:
        print(f"reference: one `roboglot up` ready after {robot.ready_after:.2f} s, {memory(robot.process.pid):.0f} MB")


def measure(claims: Claims, folder: Path, worlds: int, each: int, seconds: float) -> None:
    command = [
        sys.executable,
        "-m",
        "roboglot",
        "fleet",
        "up",
        "--data",
        str(folder / "fleet"),
        "--first-address",
        FIRST,
    ]
    command += ["--worlds", str(worlds), "--robots-each", str(each)]
    began = time.monotonic()
    with (folder / "fleet.log").open("w") as log:
        fleet = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
    assert fleet.stdout
    try:
        print(next(fleet.stdout).strip())
    except StopIteration:
        sys.exit((folder / "fleet.log").read_text())
    robots = worlds * each
    claims.at_most(f"{worlds} worlds ready", time.monotonic() - began, 6.0, "s")
    time.sleep(3.0)  # kernels and autonomy load in the background
    answer = look(folder / "fleet")
    rows = answer["shards"]
    pids = [fleet.pid, answer["nursery"], *(row["pid"] for row in rows)]
    claims.at_most(f"memory of all {robots} robots", sum(map(memory, pids)), 1600.0, "MB")
    used, began = sum(row["cpu"] for row in look(folder / "fleet")["shards"]), time.monotonic()
    times = polled([row["robots"][0]["address"] for row in rows], seconds)
    after, passed = look(folder / "fleet")["shards"], time.monotonic() - began
    factors = [row["factor"] for row in after]
    share = (sum(row["cpu"] for row in after) - used) / passed / statistics.median(factors)
    claims.at_most(f"processor time of {robots} polled robots", share, 2.0, "cores")  # whatever else the machine does
    claims.at_least("slowest world", min(factors), 0.98, "x real time")
    late = sorted(times)[-len(times) // 100] * 1e3
    print(f"median world {statistics.median(factors):.2f} x; p99 of a polled pose {late:.0f} ms")
    claims.at_most("a killed shard answers after", back_after(folder / "fleet"), 1.0, "s")
    pids = [answer["nursery"], *(row["pid"] for row in look(folder / "fleet")["shards"])]
    fleet.kill()
    fleet.wait()
    began = time.monotonic()
    while any(Path(f"/proc/{pid}/exe").exists() for pid in pids) and time.monotonic() - began < 30.0:
        time.sleep(0.02)
    left = sum(Path(f"/proc/{pid}/exe").exists() for pid in pids)
    claims.at_most("left by a killed supervisor", left, 0.5, "processes")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=25)
    parser.add_argument("--robots-each", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=10.0)
    arguments = parser.parse_args()
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        reference(Path(folder))
        measure(claims, Path(folder), arguments.worlds, arguments.robots_each, arguments.seconds)
    claims.finish()


if __name__ == "__main__":
    main()
