"""Claim: with its doors open and polled at 10 Hz, a standing lockstep robot keeps >= 0.9 of its speed, and >= 270 x.

A second of robot time is ten steps. After each step, two clients send a request: one for the pose over REST, and a text
command. That makes 20 requests per second of robot time. "Polled at 10 Hz" can also mean 10: one client that uses the
two doors in turn. Both are measured.

Figures are by the processor time of the robot's process. Windows with requests alternate with windows without any, and
with windows in which the same clients poll two bare servers in the robot's event loop (``_echoes``), which show the
cost of a door that does nothing. A part of the cost is that the process sleeps between steps and finds its caches cold:
``later`` only waits, to measure that.

At some 400 times real time these are thousands of requests per real second. A page or a script polls its robot ten
times per second of real time instead, while robot time runs on: that is measured, too.
"""

from __future__ import annotations

import http.client
import select
import socket
import statistics
import tempfile
import time
from collections.abc import Callable
from itertools import cycle
from pathlib import Path

from _claim import Claims
from _echoes import REST_PORT, TEXT_PORT
from _serving import cpu_seconds

from roboglot.testing.process import ServedRobot, served

ADDRESS = "127.0.0.22"
POSE = "/api/core/slam/v1/localization/pose"
ROUNDS, SECONDS, STEPS = 30, 5, 10
LATER = 300e-6  # s between two steps: about as long as two requests take
ROUNDS_RUN, SECONDS_RUN = 10, 400.0  # of robot time in one step
STANDING = 300  # x real time: the claim of a robot that stands

Ask = Callable[[], None]


class Clients:
    """A client of a REST door and one of a text door."""

    def __init__(self, rest_port: int, text_port: int) -> None:
        self._rest = http.client.HTTPConnection(ADDRESS, rest_port)
        self._text = socket.create_connection((ADDRESS, text_port))
        self._text.sendall(b"command;")
        self._text.recv(64)
        self._turns = cycle((self._ask_rest, self._ask_text))

    def _ask_rest(self) -> None:
        self._rest.request("GET", POSE)
        answer = self._rest.getresponse()
        answer.read()
        assert answer.status == 200

    def _ask_text(self) -> None:
        self._text.sendall(b"chassis position ?;")
        assert self._text.recv(256)

    def both(self) -> None:
        """One request at each door."""
        self._ask_rest()
        self._ask_text()

    def in_turns(self) -> None:
        """One request, at the other door each time."""
        next(self._turns)()


def later() -> None:
    """Ask nothing; return LATER."""
    end = time.perf_counter() + LATER
    while time.perf_counter() < end:
        pass


def window(robot: ServedRobot, ask: Ask) -> float:
    """Robot seconds per second of processor time, with ``ask`` after each step."""
    stdin, stdout = robot.process.stdin, robot.process.stdout
    assert stdin
    assert stdout
    before = cpu_seconds(robot.process.pid)
    for _ in range(SECONDS * STEPS):
        stdin.write(f"{1 / STEPS}\n")
        stdin.flush()
        stdout.readline()
        ask()
    return SECONDS / (cpu_seconds(robot.process.pid) - before)


def run(robot: ServedRobot, ask: Ask | None) -> float:
    """Robot seconds per second of processor time in one long step, with ``ask`` ten times a second of real time."""
    stdin, stdout = robot.process.stdin, robot.process.stdout
    assert stdin
    assert stdout
    before = cpu_seconds(robot.process.pid)
    stdin.write(f"{SECONDS_RUN}\n")
    stdin.flush()
    while not select.select([stdout], [], [], 1 / STEPS)[0]:
        if ask:
            ask()
    stdout.readline()
    return SECONDS_RUN / (cpu_seconds(robot.process.pid) - before)


def measure_runs(robot: ServedRobot) -> tuple[float, float]:
    """Return the medians of the speed while two clients ask, and of its share of the speed while no one does."""
    doors = Clients(1448, 40923)
    rounds = [(run(robot, doors.both), run(robot, None)) for _ in range(ROUNDS_RUN + 1)][1:]
    return statistics.median(asked for asked, _ in rounds), statistics.median(asked / free for asked, free in rounds)


def measure(robot: ServedRobot) -> dict[str, list[float]]:
    """Return the speeds of all windows, by who asks, after one of each that does not count."""
    doors, bare = Clients(1448, 40923), Clients(REST_PORT, TEXT_PORT)
    asked: dict[str, Ask] = {
        "no one": lambda: None,
        "no one, later": later,
        "two clients": doors.both,
        "two, bare servers": bare.both,
        "one client": doors.in_turns,
        "one, bare servers": bare.in_turns,
    }
    rounds = [{name: window(robot, ask) for name, ask in asked.items()} for _ in range(ROUNDS + 1)]
    return {name: [speeds[name] for speeds in rounds[1:]] for name in asked}


def main() -> None:
    claims = Claims()
    with (
        tempfile.TemporaryDirectory() as folder,
        served(Path(folder) / "data", "--lockstep", address=ADDRESS, module="_echoes") as robot,
    ):
        time.sleep(5)  # kernels are loaded
        speeds = measure(robot)
        run_speed, run_share = measure_runs(robot)
    free = speeds["no one"]
    shares = {name: [a / f for a, f in zip(asked, free, strict=True)] for name, asked in speeds.items()}
    for name, of in shares.items():
        low, middle, high = statistics.quantiles(of, n=4)
        print(
            f"{name:17} {statistics.median(speeds[name]):4.0f} x; share {middle:.2f}, half from {low:.2f} to {high:.2f}"
        )
    share = {name: statistics.median(of) for name, of in shares.items()}
    for ours, bare in (("two clients", "two, bare servers"), ("one client", "one, bare servers")):
        print(f"{ours}: {share[ours] / share[bare]:.2f} of what bare servers leave")
    claims.at_least("share when polled at 10 Hz of real time", run_share, 0.9, "")
    claims.at_least("speed when polled at 10 Hz of real time", run_speed, 0.9 * STANDING, "x")
    claims.at_least("share when polled at 10 Hz of robot time", share["two clients"], 0.9, "")
    claims.at_least(
        "speed when polled at 10 Hz of robot time", statistics.median(speeds["two clients"]), 0.9 * STANDING, "x"
    )
    claims.at_least("share, one client, doors in turns, of robot time", share["one client"], 0.9, "")
    claims.at_least(
        "speed, one client, doors in turns, of robot time", statistics.median(speeds["one client"]), 0.9 * STANDING, "x"
    )
    claims.finish()


if __name__ == "__main__":
    main()
