"""Floods from one address: others are answered all the while, memory is bounded, and the robot is there afterwards."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from roboglot.access.store import Grant, open_store
from roboglot.operations import Right
from roboglot.protocols.cyberdog.certificates import export_app
from roboglot.testing.process import ServedRobot, served
from tests.access.floods import FLOODS, FRIEND, GATEWAY, HOSTILE
from tests.access.matrix import ADDRESS

COUNT = 1500  # connections or attempts; half an hour's worth for the limits of one address
GROWTH_MAX = 60.0  # MB
DRIVE = frozenset({Right.DRIVE})


@pytest.fixture(scope="module")
def attacked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ServedRobot, Path]]:
    folder = tmp_path_factory.mktemp("floods")
    data, phone, config = folder / "data", folder / "phone", folder / "robots.toml"
    store = open_store(data)
    store.allow(FRIEND, [Grant("a", DRIVE)])
    store.add_person("anna", "correct horse", [Grant("a", DRIVE)])
    store.add_app("phone", [Grant("a", frozenset({Right.SEE}))])
    store.close()
    export_app(data / "cyberdog", "phone", phone)
    config.write_text(f'[access]\nlocal = false\ngateway = "{ADDRESS}:{GATEWAY}"\n[access.tls]\n')
    options = ("--world", "empty", "--no-console", "--config", str(config))
    with served(data, *options, address=ADDRESS) as robot:
        _settled(robot)
        yield robot, phone


def _settled(robot: ServedRobot) -> None:
    """Wait until the robot has loaded all that it loads after its doors are open."""
    before, calm = robot.resident_megabytes, 0
    for _ in range(60):
        time.sleep(0.5)
        now = robot.resident_megabytes
        calm = calm + 1 if now - before < 0.5 else 0
        before = now
        if calm >= 4:
            return


PACE = 0.02  # s: polling faster would hit the request limit on a quick machine


def ask(line: socket.socket) -> bytes:
    line.sendall(b"robot battery ?;")
    return line.recv(64)


@pytest.mark.parametrize(
    "flood", [pytest.param(name, marks=[] if name == "log-ins" else pytest.mark.slow) for name in FLOODS]
)
def test_others_are_served_while_one_floods(attacked: tuple[ServedRobot, Path], flood: str) -> None:
    robot, phone = attacked
    with socket.create_connection((ADDRESS, 40923), 20, source_address=(FRIEND, 0)) as line:
        line.sendall(b"command;")
        assert line.recv(64) == b"ok;"
        before = robot.resident_megabytes
        command = [sys.executable, "-m", "tests.access.floods", flood, ADDRESS, str(COUNT), str(phone)]
        with subprocess.Popen(command) as attack:
            while attack.poll() is None:
                assert ask(line).rstrip(b";").isdigit()
                time.sleep(PACE)
        assert attack.returncode == 0
        assert robot.process.poll() is None
        assert robot.resident_megabytes - before < GROWTH_MAX
    with socket.create_connection((ADDRESS, 1448), 20, source_address=(FRIEND, 0)) as line:
        line.sendall(b"GET /api/core/slam/v1/localization/pose HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n")
        answer = b""
        while piece := line.recv(4096):
            answer += piece
    assert b"200" in answer
    assert "x" in json.loads(answer.partition(b"\r\n\r\n")[2])


@pytest.mark.slow  # a load test; in short: test_guard.py
def test_a_flood_of_guesses_leaves_few_rows(attacked: tuple[ServedRobot, Path]) -> None:
    robot, phone = attacked
    FLOODS["log-ins"](ADDRESS, COUNT, phone)
    request = urllib.request.Request(f"http://{ADDRESS}:1448/")
    with pytest.raises(urllib.error.HTTPError, match="401") as refused:
        urllib.request.urlopen(request, timeout=60)
    refused.value.close()
    assert sum(path.stat().st_size for path in robot.data.glob("audit.db*")) < 5_000_000
    log = robot.data.with_name(f"{robot.data.name}.log").read_text()
    assert log.count(HOSTILE) < 100
