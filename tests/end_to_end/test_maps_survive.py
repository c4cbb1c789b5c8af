"""Maps, annotations and the robot's pose outlive kill -9."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import httpx

from roboglot.testing.addresses import free_addresses
from roboglot.testing.process import served

ADDRESS = free_addresses(1)
SLAM, MULTI = "/api/core/slam/v1", "/api/multi-floor/map/v1"
LINES = "/api/core/artifact/v1/lines/walls"
WALL = {"start": {"x": 0.0, "y": 1.0}, "end": {"x": 2.0, "y": 1.0}, "metadata": {"colour": "red"}}
SECONDS_MAX = 60.0  # until the kernels are loaded


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + SECONDS_MAX
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.1)


def test_saved_map_is_loaded_at_the_next_start(tmp_path: Path) -> None:
    with (
        served(tmp_path / "data", address=ADDRESS) as robot,
        httpx.Client(base_url=f"http://{ADDRESS}:1448", verify=False) as client,
    ):
        until(lambda: client.get(f"{SLAM}/knownarea").json()["width"] > 0)
        assert client.post(LINES, json=[WALL]).json() is True
        assert client.post(f"{MULTI}/stcm/:save").status_code == 200
        assert client.post(LINES, json=[WALL]).json() is True  # drawn, but not saved
        known = client.get(f"{SLAM}/knownarea").json()
        robot.process.kill()
        robot.process.wait()
    with (
        served(tmp_path / "data", address=ADDRESS),
        httpx.Client(base_url=f"http://{ADDRESS}:1448", verify=False) as client,
    ):
        assert client.get("/api/multi-floor/status").json()["map_load_status"] == "LOADED"
        assert client.get(f"{SLAM}/knownarea").json()["width"] >= known["width"] - 0.1
        assert [wall["id"] for wall in client.get(LINES).json()] == [1, 2]
        until(lambda: client.get(f"{SLAM}/localization/quality").json() > 80)
        pose = client.get(f"{SLAM}/localization/pose").json()
        assert abs(pose["x"]) < 0.1
        assert abs(pose["y"]) < 0.1
