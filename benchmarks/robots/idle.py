"""Claims with all doors up: ready in <= 0.5 s, <= 0.05 core idle, <= 130 MB also after drives, ends in 1 s.

A start is cold: a new process, from its call to the line "ready", when all doors answer. Its files were read before
(bytecode, libraries), certificates and the database are there, and kernels, which load after that line, are compiled.
It is measured by the clock and by processor time, which other work on the machine lengthens less.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

from _claim import Claims
from _serving import cpu_seconds

from roboglot.testing.process import ServedRobot, served

SECONDS = 10.0
ADDRESS = "127.0.0.21"
ACTIONS = f"http://{ADDRESS}:1448/api/core/motion/v1/actions"
GOALS = ((2.0, 1.0), (1.0, 4.0), (2.0, 2.0), (0.5, 0.0))


def drive(x: float, y: float) -> None:
    """A MoveTo over REST, until it has ended."""
    options = {"target": {"x": x, "y": y, "z": 0}, "move_options": {}}
    body = json.dumps({"action_name": "slamtec.agent.actions.MoveToAction", "options": options}).encode()
    request = urllib.request.Request(ACTIONS, body, {"Content-Type": "application/json"})
    action = json.load(urllib.request.urlopen(request))["action_id"]
    for _ in range(300):
        if json.load(urllib.request.urlopen(f"{ACTIONS}/{action}"))["state"]["status"] == 4:
            return
        time.sleep(0.1)


def measure(claims: Claims, robot: ServedRobot) -> None:
    """Idle, then driven, then stopped."""
    time.sleep(5)
    used, began = cpu_seconds(robot.process.pid), time.monotonic()
    time.sleep(SECONDS)
    claims.at_most("idle", (cpu_seconds(robot.process.pid) - used) / (time.monotonic() - began), 0.05, "core")
    claims.at_most("memory, idle", robot.resident_megabytes, 130, "MB")
    for goal in GOALS:
        drive(*goal)
    claims.at_most("memory, after drives", robot.resident_megabytes, 130, "MB")
    began = time.monotonic()
    robot.process.terminate()
    robot.process.wait()
    claims.at_most("SIGTERM to the end", time.monotonic() - began, 1.0, "s")


def main() -> None:
    claims, starts = Claims(), []
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        for _ in range(4):  # the first run makes certificates and caches
            with served(data, *sys.argv[1:], address=ADDRESS) as robot:
                starts.append((robot.ready_after, cpu_seconds(robot.process.pid)))
        waited, spent = (sorted(column)[1] for column in zip(*starts[1:], strict=True))
        print(f"processor time until then: {spent:.2f} s")
        claims.at_most("start to ready", waited, 0.5, "s")
        with served(data, *sys.argv[1:], address=ADDRESS) as robot:
            measure(claims, robot)
    claims.finish()


if __name__ == "__main__":
    main()
