"""A watcher in a node of faults.py: tries to drive every robot and to save places, and records each success."""

from __future__ import annotations

import http.client
import json
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

ROBOTS = {"a1": "127.10.0.1", "a2": "127.10.0.2"}
TRIES, SAVES = 0.05, 0.25  # s between two attempts to drive, and two places


def watch(node: str, file: Path) -> None:
    """Try to drive every robot and to save places, and record each success."""
    turn = threading.Lock()
    with file.open("a", buffering=1) as sights:

        def say(robot: str, what: str, place: str = "") -> None:
            with turn:
                sights.write(f"{time.monotonic()} {node} {robot} {what} {place}\n")

        for robot in ROBOTS:
            threading.Thread(target=drive, args=(robot, say), daemon=True).start()
            threading.Thread(target=save, args=(node, robot, say), daemon=True).start()
        signal.pause()


def drive(robot: str, say: Callable[..., None]) -> None:
    """Turn the robot a little, by the text door."""
    while True:
        try:
            with socket.create_connection((ROBOTS[robot], 40923), 1.0) as link:
                link.settimeout(1.0)
                link.sendall(b"command;")
                link.recv(99)
                while True:
                    link.sendall(b"chassis speed x 0 y 0 z 5;")
                    answer = link.recv(99)
                    if not answer:
                        break
                    if answer.startswith(b"ok"):
                        say(robot, "drove")
                    time.sleep(TRIES)
        except OSError:
            time.sleep(TRIES)


def save(node: str, robot: str, say: Callable[..., None]) -> None:
    """Save one place after the other, and note those that were acknowledged."""
    number = 0
    while True:
        number += 1
        place = f"{node}{number}"
        try:
            link = http.client.HTTPConnection(ROBOTS[robot], 1448, timeout=3.0)
            poi = {"id": place, "pose": {"x": 0.0, "y": 0.0, "yaw": 0.0}}
            link.request("POST", "/api/core/artifact/v1/pois", json.dumps(poi), {"Content-Type": "application/json"})
            if link.getresponse().status == 200:
                say(robot, "saved", place)
            link.close()
        except (OSError, http.client.HTTPException):
            pass
        time.sleep(SAVES)


if __name__ == "__main__":
    watch(sys.argv[1], Path(sys.argv[2]))
