"""Claim: with its doors open and polled at 10 Hz, a lockstep robot keeps >= 0.9 of its speed.

A standing robot of ``roboglot up --lockstep``: a second of robot time in ten steps, and after each, in every other
second, a pose by REST and a text command. By processor time of the robot's process, second by second in turns.
"""

from __future__ import annotations

import http.client
import socket
import statistics
import tempfile
import time
from pathlib import Path

from _claim import Claims
from _serving import cpu_seconds

from roboglot.testing.process import ServedRobot, served

ADDRESS = "127.0.0.22"
POSE = "/api/core/slam/v1/localization/pose"
WINDOWS, SECONDS, STEPS = 8, 5, 10


class Poller:
    """One client at each of the two doors."""

    def __init__(self) -> None:
        self._rest = http.client.HTTPConnection(ADDRESS, 1448)
        self._text = socket.create_connection((ADDRESS, 40923))
        self._text.sendall(b"command;")
        self._text.recv(64)

    def ask(self) -> None:
        """One request at each."""
        self._rest.request("GET", POSE)
        answer = self._rest.getresponse()
        answer.read()
        assert answer.status == 200
        self._text.sendall(b"chassis position ?;")
        assert self._text.recv(256)


def window(robot: ServedRobot, poller: Poller | None) -> float:
    """Robot seconds per second of processor time."""
    stdin, stdout = robot.process.stdin, robot.process.stdout
    assert stdin
    assert stdout
    before = cpu_seconds(robot.process.pid)
    for _ in range(SECONDS * STEPS):
        stdin.write(f"{1 / STEPS}\n")
        stdin.flush()
        stdout.readline()
        if poller is not None:
            poller.ask()
    return SECONDS / (cpu_seconds(robot.process.pid) - before)


def main() -> None:
    claims = Claims()
    with (
        tempfile.TemporaryDirectory() as folder,
        served(Path(folder) / "data", "--lockstep", address=ADDRESS) as robot,
    ):
        time.sleep(5)  # kernels are loaded
        window(robot, poller := Poller())
        pairs = [(window(robot, None), window(robot, poller)) for _ in range(WINDOWS)]
    alone, polled = (statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"standing alone {alone:.0f} x, polled {polled:.0f} x; shares", end=" ")
    print(" ".join(f"{asked / free:.2f}" for free, asked in pairs))
    claims.at_least("share when polled at 10 Hz", statistics.median(a / f for f, a in pairs), 0.9, "")
    claims.finish()


if __name__ == "__main__":
    main()
