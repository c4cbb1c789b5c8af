"""Claim: `roboglot connect` adds <= 100 µs to a round trip, <= 5 ms to the jitter of 50 Hz pushes, and 720p30 passes.

Robot, gateway and `roboglot connect` are processes on this machine; the same client asks the robot directly and through
the tunnel, in turns, over the text protocol. The best stretch of round trips counts, because other work only adds time.
The robot is pinned to one core; the client and `connect`, which are usually on another machine, share a second core.
Without pinning, the kernel of a virtual machine may run two of the three on one core, because it takes idle cores to
be in use by other machines. That case is printed, too.

    scripts/bench connect
"""

from __future__ import annotations

import contextlib
import itertools
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from _claim import Claims

from roboglot.access.store import Grant, open_store
from roboglot.operations import Right
from roboglot.testing.process import served

ROBOT, HERE, GATEWAY = "127.0.98.1", "127.0.98.2", 50090
DIRECT = "127.0.98.3"  # of the client without a tunnel
PUSH_PORT = 40924
ROUNDS, TRIPS = 20, 250
SECONDS = 10.0


@contextlib.contextmanager
def tunnel(token: str, settings: Path) -> Iterator[subprocess.Popen[str]]:
    """Yield the robot's ports at HERE."""
    environment = {**os.environ, "ROBOGLOT_TOKEN": token, "XDG_CONFIG_HOME": str(settings)}
    command = [sys.executable, "-m", "roboglot", "connect", f"{ROBOT}:{GATEWAY}", "--address", HERE, "--once"]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("ready")
        yield process
        process.terminate()


def line(address: str, own: str) -> socket.socket:
    connection = socket.create_connection((address, 40923), 20, source_address=(own, 0))
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.sendall(b"command;")
    connection.recv(64)
    return connection


def round_trips(connection: socket.socket) -> list[float]:
    """µs of each."""
    spent = []
    for _ in range(TRIPS):
        began = time.perf_counter()
        connection.sendall(b"robot mode ?;")
        connection.recv(64)
        spent.append(1e6 * (time.perf_counter() - began))
    return spent


def pushes(connection: socket.socket, host: str) -> tuple[float, float]:
    """ms that the 99th percentile of intervals of 50 Hz pushes to ``host`` is off, and how many come in a second."""
    inbox = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    inbox.bind((host, PUSH_PORT))
    inbox.settimeout(5.0)
    connection.sendall(b"chassis push attitude on afreq 50;")
    connection.recv(64)
    stamps = []
    end = time.perf_counter() + SECONDS
    while time.perf_counter() < end:
        inbox.recv(2048)
        stamps.append(time.perf_counter())
    inbox.close()
    connection.sendall(b"chassis push attitude off;")
    connection.recv(64)
    off = sorted(1000 * abs(later - earlier - 1 / 50) for earlier, later in itertools.pairwise(stamps))
    return off[int(0.99 * len(off))], (len(stamps) - 1) / (stamps[-1] - stamps[0])


def frames(connection: socket.socket, address: str, own: str) -> float:
    """Pictures a second of the video at ``address``: access units of its H.264."""
    connection.sendall(b"stream on;")
    connection.recv(64)
    video = socket.create_connection((address, 40921), 20, source_address=(own, 0))
    video.settimeout(5.0)
    video.recv(65536)
    data, began = bytearray(), time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        data += video.recv(1 << 20)
    spent = time.perf_counter() - began
    video.close()
    connection.sendall(b"stream off;")
    connection.recv(64)
    first = [at for at in _starts(data) if data[at + 3] & 31 in (1, 5) and data[at + 4] & 0x80]  # slices at the top
    return len(first) / spent


def _starts(data: bytearray) -> Iterator[int]:
    at = data.find(b"\0\0\1")
    while 0 <= at < len(data) - 4:
        yield at
        at = data.find(b"\0\0\1", at + 3)


def keep_to(*cores: int, of: int = 0) -> None:
    """Have a process (0: this one, and those it starts) run there, with all of its threads."""
    for thread in os.listdir(f"/proc/{of or 'self'}/task"):
        with contextlib.suppress(ProcessLookupError):
            os.sched_setaffinity(int(thread), cores)


def turns(far: socket.socket, near: socket.socket) -> tuple[float, float]:
    """µs of the best stretch directly and through the tunnel."""
    near_spent, far_spent = [], []
    for _ in range(ROUNDS):
        near_spent.append(statistics.median(round_trips(near)))
        far_spent.append(statistics.median(round_trips(far)))
    pairs = statistics.median(there - here for here, there in zip(near_spent, far_spent, strict=True))
    print(f"round trip: {min(near_spent):.0f} µs directly, {min(far_spent):.0f} µs through the tunnel")
    print(f"in the middle of {ROUNDS} turns {pairs:.0f} µs more; load of the machine {os.getloadavg()[0]:.1f}")
    return min(near_spent), min(far_spent)


def main() -> None:
    claims = Claims()
    cores = sorted(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as name:
        data, config = Path(name) / "data", Path(name) / "robots.toml"
        store = open_store(data)
        token = store.add_machine("cell", [Grant("a", frozenset({Right.DRIVE}))])
        store.allow(DIRECT, [Grant("a", frozenset({Right.DRIVE}))])
        store.close()
        config.write_text(f'[access]\nlocal = false\nrequests = 100_000\ngateway = "{ROBOT}:{GATEWAY}"\n')
        options = ("--no-console", "--config", str(config))
        with served(data, *options, address=ROBOT) as robot, tunnel(token, Path(name) / "settings") as connector:
            time.sleep(5)  # kernels are loaded
            far, near = line(HERE, "127.0.0.1"), line(ROBOT, DIRECT)
            print("without a core for each machine:")
            turns(far, near)
            keep_to(cores[0], of=robot.process.pid)
            keep_to(cores[-1], of=connector.pid)
            keep_to(cores[-1])
            print("with one:")
            directly, through_it = turns(far, near)
            for process in (0, robot.process.pid, connector.pid):
                keep_to(*cores, of=process)
            claims.at_most("added to a round trip", through_it - directly, 100.0, "µs")
            off, rate = pushes(near, DIRECT)
            far_off, far_rate = pushes(far, "127.0.0.1")
            print(f"50 Hz pushes: intervals {off:.1f} ms off directly, {far_off:.1f} ms through the tunnel (p99)")
            claims.at_most("added to that", far_off - off, 5.0, "ms")
            claims.at_least("pushes that come", far_rate / rate, 0.99, "")
            usual, through = frames(near, ROBOT, DIRECT), frames(far, HERE, "127.0.0.1")
            print(f"720p video: {usual:.1f} pictures/s directly, {through:.1f} through the tunnel")
            claims.at_least("share of the pictures", through / usual, 0.97, "")
    claims.finish()


if __name__ == "__main__":
    main()
