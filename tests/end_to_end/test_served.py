"""``roboglot up`` as a process: it comes up, answers at every door, survives what is thrown at it, and stops."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import pytest

from roboglot.testing.addresses import free_addresses
from roboglot.testing.process import ServedRobot, child, served

FIRST = free_addresses(2)
SECOND = str(ip_address(FIRST) + 1)
ALONE = free_addresses(1)
POIS = "/api/core/artifact/v1/pois"
POSE = "/api/core/slam/v1/localization/pose"
TCP_PORTS = (1448, 40923, 40925, 50052)


def get(path: str, address: str = FIRST) -> Any:
    with urllib.request.urlopen(f"http://{address}:1448{path}", timeout=60) as answer:
        return json.load(answer)


def post(path: str, body: object, address: str = FIRST) -> None:
    request = urllib.request.Request(
        f"http://{address}:1448{path}", json.dumps(body).encode(), {"Content-Type": "application/json"}
    )
    urllib.request.urlopen(request, timeout=60).close()


class Line:
    """A text client; the robot stops what it commanded when it hangs up."""

    def __init__(self, address: str) -> None:
        self._socket = socket.create_connection((address, 40923), timeout=60)

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def say(self, commands: str) -> list[str]:
        """Send the commands one by one, read each reply."""
        replies = []
        for command in commands.split(";"):
            self._socket.sendall(f"{command};".encode())
            replies.append(self._socket.recv(4096).decode())
        return replies


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedRobot]:
    """Two robots in one process."""
    data = tmp_path_factory.mktemp("pair") / "data"
    with served(data, "--robot", "b=universal", address=FIRST) as robots:
        yield robots


def test_second_robot_has_same_ports_on_next_address(pair: ServedRobot) -> None:
    for address in (FIRST, SECOND):
        for port in TCP_PORTS:
            socket.create_connection((address, port), timeout=60).close()
    with Line(SECOND) as line:
        assert line.say("command;chassis move x 0.3") == ["ok;", "ok;"]
        assert wait_for(lambda: float(get(POSE, SECOND)["x"]) > 0.2)
    assert abs(float(get(POSE, FIRST)["x"])) < 0.05


def test_task_begun_at_one_door_ends_at_another(pair: ServedRobot) -> None:
    target = {"x": 4.0, "y": 0.0, "z": 0.0}
    post(
        "/api/core/motion/v1/actions",
        {"action_name": "slamtec.agent.actions.MoveToAction", "options": {"target": target, "move_options": {}}},
    )
    action = get("/api/core/motion/v1/actions/:current")
    with Line(FIRST) as line:
        assert line.say("command;chassis speed x 0 y 0 z 0")[1] == "ok;"
    path = f"/api/core/motion/v1/actions/{action['action_id']}"
    assert wait_for(lambda: get(path)["state"]["status"] == 4)  # it has braked
    assert get(path)["state"]["result"] == -2


def test_garbage_at_every_door_harms_no_one(pair: ServedRobot) -> None:
    garbage = [b"\x00\xff" * 5000, b"GET " + b"a" * 100_000, b";" * 3000, b"{" * 70_000, b"\r\n\r\n"]
    half_open = []
    for port in TCP_PORTS:
        for junk in garbage:
            with socket.create_connection((FIRST, port), timeout=60) as connection:
                connection.settimeout(5)
                try:
                    connection.sendall(junk)
                except OSError:
                    continue  # it may hang up half-way
        half_open.append(socket.create_connection((FIRST, port), timeout=60))
    assert isinstance(get(POSE), dict)
    with Line(FIRST) as line:
        assert line.say("command;quit") == ["ok;", "ok;"]
    assert pair.process.poll() is None
    for kept in half_open:
        kept.close()


@pytest.mark.slow  # three thousand requests
def test_memory_does_not_grow_with_requests(pair: ServedRobot) -> None:
    assert wait_for(lambda: get("/api/core/slam/v1/knownarea")["width"] > 0)  # everything is loaded
    for _ in range(1500):  # one-off late loading does not count
        get(POSE)
    before = pair.resident_megabytes
    for _ in range(1500):
        get(POSE)
    assert pair.resident_megabytes - before < 8


def test_acknowledged_data_survives_kill_9(tmp_path: Path) -> None:
    data = tmp_path / "data"
    poi = {"id": "kitchen", "pose": {"x": 1.5, "y": -2.25, "yaw": 0.5}, "metadata": {"display_name": "厨房"}}
    with served(data, "--world", "empty", address=ALONE) as robot:
        post(POIS, poi, ALONE)
        robot.process.send_signal(signal.SIGKILL)
        robot.process.wait()
    with served(data, "--world", "empty", address=ALONE):
        [stored] = get(POIS, ALONE)
    assert stored["id"] == "kitchen"
    assert stored["metadata"]["display_name"] == "厨房"
    assert stored["pose"]["y"] == pytest.approx(-2.25)


def test_it_stops_cleanly_on_a_signal(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with served(tmp_path / "data", "--world", "empty", address=ALONE, log=log) as robot:
        robot.process.send_signal(signal.SIGINT)
        assert robot.process.wait(10) == 0
    assert "Traceback" not in log.read_text()
    assert "Exception" not in log.read_text()


STUCK = """
# warm
import os
import time
from roboglot.hosting import process
process.LAST_SECONDS = 0.1
os.dup2(1, 2)
process.end_in_any_case()
print("stuck", flush=True)
time.sleep(60)
"""


def test_a_stuck_end_is_forced_and_named() -> None:
    with child(STUCK) as process:
        assert process.stdout
        assert process.stdout.readline() == "stuck\n"
        assert process.stdout.read() == "roboglot: still closing after 0.1 s, so it ends now\n"
        assert process.wait(20) == 1


def test_it_ends_in_middle_of_day_of_lockstep(tmp_path: Path) -> None:
    with served(tmp_path / "data", "--lockstep", "--world", "empty", address=ALONE) as robot:
        assert robot.process.stdin
        with Line(ALONE) as line:
            assert line.say("command;chassis speed x 0.1") == ["ok;", "ok;"]
            robot.process.stdin.write("86400\n")
            robot.process.stdin.flush()
            time.sleep(0.3)  # in the middle of the move
            robot.process.send_signal(signal.SIGTERM)
            assert robot.process.wait(10) == 0


def test_lockstep_time_passes_by_lines_on_standard_input(tmp_path: Path) -> None:
    with served(tmp_path / "data", "--lockstep", "--world", "empty", address=ALONE) as robot:
        assert robot.process.stdin
        assert robot.process.stdout
        robot.process.stdin.write("9" * 300 + "\n-1\nnan\n")
        robot.process.stdin.flush()
        assert [robot.process.stdout.readline() for _ in range(3)] == ["time 0.000\n"] * 3
        with Line(ALONE) as line:
            assert line.say("command;chassis move x 0.5") == ["ok;", "ok;"]
            assert abs(float(get(POSE, ALONE)["x"])) < 0.001
            robot.process.stdin.write("5\n")
            robot.process.stdin.flush()
            assert robot.process.stdout.readline() == "time 5.000\n"
            assert float(get(POSE, ALONE)["x"]) == pytest.approx(0.5, abs=0.05)


def refused(*starts: tuple[str, ...]) -> list[str]:
    """Start robots that must fail, one after the other; what each says."""
    said = []
    for arguments in starts:
        command = [sys.executable, "-m", "roboglot", "up", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
        assert done.returncode == 1, done.stderr
        assert "Traceback" not in done.stderr
        said.append(done.stderr)
    return said


def test_mistakes_are_reported_in_plain_words(pair: ServedRobot, tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "roboglot.db").write_bytes(b"no database" * 1000)
    errors = refused(
        ("--data", str(pair.data), "--address", ALONE),
        ("--data", str(tmp_path / "1"), "--address", FIRST),
        ("--data", str(tmp_path / "2"), "--world", "atlantis"),
        ("--data", str(tmp_path / "3"), "--robot", "b"),
        ("--data", str(broken), "--address", ALONE),
        ("--data", str(tmp_path / "4"), "--robot", "b=octopus"),
    )
    for words, said in zip(
        ("another roboglot uses", "1448", "atlantis", "name=body", "database", "octopus"), errors, strict=True
    ):
        assert words in said


def wait_for(condition: object, seconds: float = 60.0) -> bool:
    """Look until it holds; False if it never does."""
    assert callable(condition)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.05)
    return False
