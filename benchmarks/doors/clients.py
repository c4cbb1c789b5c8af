"""Claims: with a client for each robot, text and REST answer in 30 ms and gRPC in 60 (p99), pushes at 9.9 of 10 Hz.

25 robots of three bodies in one program, five of them filmed; 50 without films; 100 in two shards. Robot time goes on
as real time does. The clients are a separate process on the same machine (benchmarks/_pupils.py): what they wait
for, and how late they themselves are, is in the figures.

    scripts/bench clients [--robots 25 --films 5 --shards 1] [--seconds 15]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from ipaddress import IPv4Address
from pathlib import Path
from typing import Any, NamedTuple

from _claim import Claims
from _pupils import GRPC, REST, TEXT, Lesson, Seen, in_a_process, percentile

from roboglot.clients.cyberdog import Certificates
from roboglot.hosting import local_socket
from roboglot.protocols.cyberdog.certificates import ensure_certificates
from roboglot.shards.requests import SOCKET

FIRST, APP = IPv4Address("127.16.1.1"), "127.16.9.1:18985"
PATIENCE = 120.0
LINES = 20  # of each shard's log
LIMITS = {REST: ("REST", 30.0), TEXT: ("text", 30.0), GRPC: ("gRPC", 60.0)}  # ms, 99th percentile


class Part(NamedTuple):
    """One of the three claims."""

    robots: int
    films: int
    shards: int


PARTS = (Part(25, 5, 1), Part(50, 0, 1), Part(100, 0, 2))


def template(robots: int) -> str:
    """Return the configuration of one world."""
    bodies = [(REST, TEXT, GRPC)[number % 3] for number in range(robots)]
    lines = [f'[[robots]]\nname = "r{number}_"\nbody = "{body}"' for number, body in enumerate(bodies)]
    return "\n".join([*lines, "[cyberdog]", f'app = "{APP}"', "[console]", "enabled = false"])


def cpu(folder: Path) -> float:
    """Return the processor time of all shards so far, s."""
    used: float = sum(row["cpu"] for row in look(folder)["shards"])
    return used


def starved(folder: Path) -> float:
    """Return the s that the serving threads of all shards wanted a processor so far, and others had it."""
    waits = [Path(f"/proc/{row['pid']}/schedstat").read_text().split()[1] for row in look(folder)["shards"]]
    return sum(map(int, waits)) / 1e9


def look(folder: Path) -> dict[str, Any]:
    """Return what `roboglot fleet list --json` shows."""
    answer: dict[str, Any] = json.loads(asyncio.run(local_socket.ask(folder / SOCKET, b"{}", PATIENCE)))
    return answer


@contextmanager
def fleet(folder: Path, part: Part) -> Iterator[Path]:
    """Start the shards; all dogs have the same certificates, as all apps come from one process."""
    (folder / "class.toml").write_text(template(part.robots // part.shards))
    ensure_certificates(folder)
    for number in range(part.shards):
        shutil.copytree(folder / "tls", folder / "fleet" / "shards" / f"w{number + 1}" / "data" / "cyberdog" / "tls")
    command = [sys.executable, "-m", "roboglot", "fleet", "up", "--data", str(folder / "fleet")]
    command += ["--worlds", str(part.shards), "--template", str(folder / "class.toml"), "--first-address", str(FIRST)]
    with (folder / "fleet.log").open("w") as log:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
    assert process.stdout
    try:
        print(process.stdout.readline().strip() or (folder / "fleet.log").read_text())
        yield folder / "fleet"
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)


def measure(claims: Claims, part: Part, settle: float, seconds: float) -> None:
    """Print what the clients of one part saw."""
    with tempfile.TemporaryDirectory() as temporary, fleet(Path(temporary), part) as folder:
        rows = look(folder)["shards"]
        robots = [(robot["body"], robot["address"]) for row in rows for robot in row["robots"]]
        filmed = [address for body, address in robots if body == TEXT][: part.films]
        proof = Certificates.load(Path(temporary) / "tls")
        with ThreadPoolExecutor(1) as beside:
            lesson = beside.submit(in_a_process, Lesson(robots, set(filmed), proof, APP, settle, seconds))
            time.sleep(settle + 1.0)
            began, used, waited = time.monotonic(), cpu(folder), starved(folder)
            factors: dict[str, list[float]] = {row["name"]: [] for row in rows}
            while not lesson.done() and time.monotonic() - began < seconds - 1.0:
                time.sleep(1.0)
                for row in look(folder)["shards"]:
                    factors[row["name"]].append(row["factor"])
            passed = time.monotonic() - began
            cores, share = (cpu(folder) - used) / passed, (starved(folder) - waited) / passed / part.shards
            seen, own = lesson.result()
        for log in (folder / "shards").glob("*/log"):
            worth = [line for line in log.read_text().splitlines() if " INFO " not in line]
            print("".join(f"  {line}\n" for line in worth[:LINES]), end="")
    report(claims, part, seen)
    print(
        f"reference: the clients' own loop was late by {percentile(own.late, 0.99):.1f} ms (p99), {own.cores:.2f} cores"
    )
    print(f"reference: the serving threads waited for a processor for {share:.0%} of the time")
    print(f"{cores:.2f} cores, load {os.getloadavg()[0]:.1f}")
    slowest = min(sum(each) / len(each) for each in factors.values())
    claims.at_least("robot time, slowest shard", slowest, 0.995, "x real time")


def report(claims: Claims, part: Part, seen: dict[str, Seen]) -> None:
    """Print what the clients of one part saw beside the claims."""
    print(f"== {part.robots} robots, {part.films} of them filmed, in {part.shards} shard(s)")
    for kind, (name, limit) in LIMITS.items():
        print(f"{name}: {len(seen[kind].waits)} answers, {seen[kind].refused} of them refusals", end="; ")
        print(f"median {seen[kind].percentile(0.5):.1f} ms, all within {seen[kind].percentile(1.0):.0f} ms")
        claims.at_most(f"{name}, p99", seen[kind].percentile(0.99), limit, "ms")
    claims.at_least("pushes, worst robot", min(seen[TEXT].pushes), 9.9, "Hz")
    claims.at_least("heartbeats of dogs, worst robot", min(seen[GRPC].pushes), 0.95, "x 2 Hz")
    if seen[TEXT].pictures:
        print(f"pictures a second: {', '.join(f'{rate:.1f}' for rate in seen[TEXT].pictures)}")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=0)
    parser.add_argument("--films", type=int, default=0)
    parser.add_argument("--shards", type=int, default=1)
    parser.add_argument("--settle", type=float, default=12.0, help="s until dogs stand and kernels are loaded")
    parser.add_argument("--seconds", type=float, default=15.0)
    chosen, claims = parser.parse_args(), Claims()
    for part in [Part(chosen.robots, chosen.films, chosen.shards)] if chosen.robots else PARTS:
        measure(claims, part, chosen.settle, chosen.seconds)
    claims.finish()


if __name__ == "__main__":
    main()
