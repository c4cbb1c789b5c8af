"""A fleet of real processes with real sockets: what dies comes back where it was, with what it had stored."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import pytest

from roboglot.hosting import local_socket
from roboglot.shards.requests import SOCKET
from roboglot.shards.supervisor import SILENCE_MAX
from roboglot.testing.addresses import free_addresses

PATIENCE = 150.0  # s; a busy machine is twenty times slower than a quiet one
FIRST = free_addresses(4)
SECOND, THIRD, FOURTH = (str(ip_address(FIRST) + further) for further in (1, 2, 3))
TEMPLATE = """
world = "office"
[[robots]]
name = "a"
[[robots]]
name = "b"
[console]
enabled = false
"""
POI = {"id": "desk", "pose": {"x": 1.0, "y": 2.0, "yaw": 0.5}, "metadata": {"display_name": "desk"}}


class Fleet:
    """``roboglot fleet up`` in a separate process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.process: subprocess.Popen[str] | None = None

    def up(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "roboglot", "fleet", "up", "--data", str(self.folder), *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        patience = threading.Timer(PATIENCE, self.process.kill)
        patience.start()
        assert self.process.stdout
        assert any(line.strip() == "ready" for line in self.process.stdout), "the fleet did not come up"
        patience.cancel()

    def call(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "roboglot", "fleet", *arguments, "--data", str(self.folder)]
        return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)

    def look(self) -> Any:
        """Return what ``fleet list --json`` prints, without a process for it."""
        return json.loads(asyncio.run(local_socket.ask(self.folder / SOCKET, b"{}", PATIENCE)))

    def shards(self) -> dict[str, dict[str, Any]]:
        return {row["name"]: row for row in self.look()["shards"]}

    def processes(self) -> list[int]:
        return [self.look()["nursery"], *(row["pid"] for row in self.look()["shards"])]

    def until(self, shard: str, **wanted: Any) -> dict[str, Any]:
        deadline = time.monotonic() + PATIENCE
        while True:
            row = self.shards()[shard]
            if all(row[key] == value for key, value in wanted.items()):
                return row
            assert time.monotonic() < deadline, row
            time.sleep(0.2)

    def end(self) -> None:
        assert self.process is not None
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(PATIENCE)
        assert self.process.stdout
        self.process.stdout.close()


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    folder = tmp_path_factory.mktemp("fleet")
    template = folder / "class.toml"
    template.write_text(TEMPLATE)
    made = Fleet(folder / "f")
    made.up("--worlds", "2", "--template", str(template), "--first-address", FIRST)
    yield made
    if made.process is not None and made.process.poll() is None:
        made.end()


def ask(address: str, path: str, body: object = None) -> Any:
    url = f"http://{address}:1448/api/core/{path}"
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
        text = answer.read()
    return json.loads(text) if text else None


def pois(address: str) -> list[str]:
    return [poi["id"] for poi in ask(address, "artifact/v1/pois")]


def gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


def wait_until_gone(pids: list[int]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not all(map(gone, pids)):
        assert time.monotonic() < deadline, [pid for pid in pids if not gone(pid)]
        time.sleep(0.05)


def test_every_robot_answers_at_address_of_its_own(fleet: Fleet) -> None:
    robots = {robot["name"]: robot["address"] for row in fleet.shards().values() for robot in row["robots"]}
    assert robots == {"a1": FIRST, "b1": SECOND, "a2": THIRD, "b2": FOURTH}
    assert len({ask(address, "system/v1/robot/info")["deviceID"] for address in robots.values()}) == 4
    assert json.loads(fleet.call("list", "--json").stdout)["shards"][0]["name"] == "w1"


def test_killed_shard_returns_with_what_it_acknowledged(fleet: Fleet) -> None:
    before = fleet.shards()
    ask(FIRST, "artifact/v1/pois", POI)
    os.kill(before["w1"]["pid"], signal.SIGKILL)
    after = fleet.until("w1", state="ready", restarts=before["w1"]["restarts"] + 1)
    assert after["pid"] != before["w1"]["pid"]
    assert pois(FIRST) == ["desk"]
    assert fleet.shards()["w2"]["pid"] == before["w2"]["pid"], "the other world went on"


@pytest.mark.slow  # waits; in short: test_killed_shard_returns_with_what_it_acknowledged
def test_a_hung_shard_is_killed_and_started_again(fleet: Fleet) -> None:
    assert SILENCE_MAX < PATIENCE
    before = fleet.shards()["w2"]
    os.kill(before["pid"], signal.SIGSTOP)
    fleet.until("w2", state="ready", restarts=before["restarts"] + 1)
    assert ask(THIRD, "slam/v1/localization/pose")


def test_stopped_stays_stopped_and_restart_brings_it_back(fleet: Fleet) -> None:
    assert fleet.call("stop", "a2").returncode == 0
    assert fleet.shards()["w2"]["state"] == "stopped"
    with pytest.raises(OSError, match="refused"):
        ask(THIRD, "slam/v1/localization/pose")
    assert fleet.call("restart", "w2").returncode == 0
    assert ask(THIRD, "slam/v1/localization/pose")


def test_robot_moves_with_its_address_and_stored_data(fleet: Fleet) -> None:
    ask(SECOND, "artifact/v1/pois", {**POI, "id": "shelf"})
    plate = ask(SECOND, "system/v1/robot/info")["deviceID"]
    moved = fleet.call("move", "b1", "w2")
    assert (moved.returncode, moved.stdout.split()[:4]) == (0, ["w2", "ready", "a2,", "b2,"])
    assert ask(SECOND, "system/v1/robot/info")["deviceID"] == plate, "apps know it by its serial number"
    homes = {name: [robot["name"] for robot in row["robots"]] for name, row in fleet.shards().items()}
    assert homes == {"w1": ["a1"], "w2": ["a2", "b2", "b1"]}
    assert pois(SECOND) == ["shelf"]
    refused = fleet.call("move", "a1", "w2")
    assert refused.returncode == 1
    assert "only robot" in refused.stderr


def test_reset_forgets_what_was_stored(fleet: Fleet) -> None:
    ask(THIRD, "artifact/v1/pois", {**POI, "id": "lamp"})
    assert fleet.call("reset", "w2").returncode == 0
    assert pois(THIRD) == []


def test_unknown_shards_are_refused_by_name(fleet: Fleet) -> None:
    refused = fleet.call("restart", "w9")
    assert refused.returncode == 1
    assert "'w9'" in refused.stderr
    second = fleet.call("up")
    assert second.returncode == 1
    assert "another roboglot uses" in second.stderr


@pytest.mark.slow
def test_logs_and_top_show_shards(fleet: Fleet) -> None:
    assert fleet.call("logs", "w1").returncode == 0
    table = fleet.call("top").stdout  # in a pipe: one table
    assert "2 shards, 4 robots" in table
    assert any(float(row.split()[4]) > 0 for row in table.splitlines() if row.startswith("w"))  # cores


@pytest.mark.slow  # long; in short: test_killed_shard_returns_with_what_it_acknowledged
def test_killed_parents_leave_no_orphan_and_no_lock(fleet: Fleet) -> None:
    """The nursery first: the supervisor starts it again, and the shards. Then the supervisor: everything ends."""
    nursery, *shards = fleet.processes()
    os.kill(nursery, signal.SIGKILL)
    wait_until_gone([nursery, *shards])
    for name in ("w1", "w2"):
        fleet.until(name, state="ready")
    pids = fleet.processes()
    assert nursery not in pids
    ask(FIRST, "artifact/v1/pois", {**POI, "id": "window"})
    assert fleet.process is not None
    assert fleet.process.stdout
    fleet.process.kill()
    fleet.process.wait(PATIENCE)
    fleet.process.stdout.close()
    wait_until_gone(pids)
    fleet.up()
    assert "window" in pois(FIRST), "the same fleet, with its stored state"
    fleet.end()
