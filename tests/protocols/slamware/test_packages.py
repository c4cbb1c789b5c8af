"""Firmware and apps through a real socket: from the maker, uploaded, and what makes no sense."""

from __future__ import annotations

import asyncio
import io
import json
import zipfile
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from roboglot.model.components.system.apps import Apps
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import Firmware, FirmwareState
from roboglot.model.robot import Robot
from roboglot.simulation.components.system.firmware_record import FirmwareRecord
from roboglot.simulation.world.world import World
from roboglot.testing import Forward

pytestmark = pytest.mark.world("empty")
SYSTEM, FIRMWARE = "/api/core/system/v1", "/api/core/firmware/v1"
DATA = Path(__file__).parents[2] / "data" / "packages"


@pytest.mark.slow  # in short: test_an_uploaded_update
async def test_an_update_from_the_maker(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    offered = (await client.get(f"{FIRMWARE}/newversion")).json()
    assert offered["firmware"] != robot[Firmware].version
    before = (await client.get(f"{FIRMWARE}/progress")).json()
    assert (before["current_step"], before["status"], before["toptalSteps"]) == (0, 2, 6)
    assert (await client.get(f"{FIRMWARE}/autoupdate/:enable")).json() is False
    await client.put(f"{FIRMWARE}/autoupdate/:enable", json={"enable": True})
    assert robot[Firmware].automatic
    assert (await client.post(f"{FIRMWARE}/autoupdate/:start")).json() == {"result": True, "reason": ""}
    assert (await client.post(f"{FIRMWARE}/autoupdate/:start")).json()["result"] is False
    await forward(seconds=10)
    during = (await client.get(f"{FIRMWARE}/progress")).json()
    assert (during["current_step_name"], during["status"]) == ("Downloading", 3)
    assert 0 < during["current_step_progress"] < 100
    await forward(seconds=120)
    assert robot[Firmware].version == offered["firmware"]
    assert (await client.get(f"{FIRMWARE}/newversion")).json() == {}
    assert (await client.post(f"{FIRMWARE}/autoupdate/:start")).json()["result"] is False


async def test_apps_are_listed_and_removed(robot: Robot, world: World, client: httpx.AsyncClient) -> None:
    apps = "/api/core/application/v1/apps"
    await robot[Apps].install("org.example", "1.2", io.BytesIO(b"package"))
    assert (await client.get(apps)).json() == [{"name": "org.example", "version": "1.2"}]
    world.faults.inject("full_disk", "a")
    assert (await client.delete(f"{apps}/org.example")).status_code == 200
    assert (await client.delete(f"{apps}/org.example")).status_code == 404


async def test_apps_are_installed_from_android_packages(robot: Robot, client: httpx.AsyncClient) -> None:
    apps, package = "/api/core/application/v1/apps", (DATA / "example.apk").read_bytes()
    free = robot[Disk].free
    reply = await client.post(apps, content=package)
    assert (reply.status_code, reply.content) == (200, b"")
    assert (await client.get(apps)).json() == [{"name": "com.example.menu", "version": "1.2.3"}]
    assert robot[Disk].free == free - len(package)
    for content in (b"", b"no package", package[:-30]):
        refused = await client.post(apps, content=content)
        assert (refused.status_code, refused.reason_phrase) == (400, "Failed to install application")
    robot[Disk].take("everything", robot[Disk].free)
    assert (await client.post(apps, content=package)).status_code == 500
    robot[Disk].release("everything")
    assert (await client.delete(f"{apps}/com.example.menu")).status_code == 200
    assert robot[Disk].free == free


async def test_packages_are_bounded(client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch) -> None:
    async def endless() -> AsyncIterator[bytes]:
        for _ in range(100):
            yield b"x" * 1000

    monkeypatch.setattr("roboglot.protocols.slamware.parameters.PACKAGE_MAX", 5000)
    for content in (endless(), b"x" * 5001):  # of unknown and of announced length
        reply = await client.post(f"{FIRMWARE}/update/:start", content=content)
        assert reply.status_code == 413


def firmware(version: str, **more: object) -> bytes:
    """Return a package as the page of the protocol describes it."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("firmware.json", json.dumps({"version": version, **more}))
        archive.writestr("image.bin", b"\0" * 2_000_000)
    return target.getvalue()


async def test_an_uploaded_update(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    start = f"{FIRMWARE}/update/:start"
    for content in (b"nothing", firmware("9.9", model="another robot")):
        refused = (await client.post(start, content=content)).json()
        assert (refused["result"], bool(refused["msg"])) == (False, True)
    free = robot[Disk].free
    package = firmware("1.0.1", modules={"motion": "7"})
    reply = (await client.post(start, content=package)).json()
    assert reply == {"result": True, "msg": "", "data": {"version": "1.0.1"}}
    await forward(seconds=0.02)
    assert robot[Disk].free == free - len(package)
    again = (await client.post(start, content=package)).json()
    assert (again["result"], again["msg"]) == (False, "an update is under way")
    steps = set()
    for _ in range(60):
        await forward(seconds=0.05)
        try:
            progress = (await client.get(f"{FIRMWARE}/progress")).json()
        except httpx.TransportError:
            break
        steps.add((progress["current_step_name"], progress["status"]))
    assert ("Updating", 3) in steps
    assert "Downloading" not in {name for name, _ in steps}  # it was handed over
    await forward(seconds=60)
    assert (robot[Firmware].version, robot[Firmware].modules["motion"]) == ("1.0.1", "7")
    assert robot[Disk].free == free
    info = (await client.get(f"{SYSTEM}/robot/info")).json()
    assert (await client.get(f"{FIRMWARE}/progress")).json()["status"] == 2
    assert info["softwareVersion"] == "1.0.1"


async def test_an_update_that_fails_says_so(
    robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    world.faults.inject("low_battery", "a", charge=0.2)
    version = robot[Firmware].version
    assert (await client.post(f"{FIRMWARE}/update/:start", content=firmware("9.9"))).json()["result"] is True
    await forward(seconds=60)
    progress = (await client.get(f"{FIRMWARE}/progress")).json()
    assert (progress["status"], progress["error_code"]) == (1, 1)
    assert robot[Firmware].version == version


async def test_an_update_runs_once_it_is_accepted(
    client: httpx.AsyncClient, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def write(_record: FirmwareRecord, _package: object) -> None:
        await asyncio.Event().wait()  # a slow disk

    monkeypatch.setattr(FirmwareRecord, "put_downloaded", write)
    await forward(seconds=1)
    reply = (await client.post(f"{FIRMWARE}/update/:start", content=firmware("1.0.1"))).json()
    assert reply["result"] is True
    assert (await client.get(f"{FIRMWARE}/progress")).json()["status"] == 3


async def test_a_waiting_package_is_no_running_update(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    """As a power cut during the installation, or another door, leaves it."""
    await forward(seconds=1)
    package = robot[Firmware].available
    assert package is not None
    download = robot[Firmware].download(package)
    await forward(seconds=120)
    assert download.status.ended
    assert robot[Firmware].progress.state is FirmwareState.DOWNLOADED
    progress = (await client.get(f"{FIRMWARE}/progress")).json()
    assert (progress["current_step_name"], progress["status"]) == ("DownloadFinished", 2)


async def test_a_running_update_is_not_begun_anew(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    package = robot[Firmware].available
    assert package is not None
    download = robot[Firmware].download(package)  # as the robot itself, or another door, does
    await forward(seconds=5)
    share = robot[Firmware].progress.share
    refused = (await client.post(f"{FIRMWARE}/autoupdate/:start")).json()
    assert refused == {"result": False, "reason": "an update is under way"}
    await forward(seconds=1)
    assert not download.status.ended
    assert robot[Firmware].progress.share > share > 0


async def test_versions_have_no_control_characters(client: httpx.AsyncClient) -> None:
    for package in (firmware("2.1\n0"), firmware("2.1\n"), firmware("2", modules={"a": "\x00"})):
        reply = (await client.post(f"{FIRMWARE}/update/:start", content=package)).json()
        assert reply["result"] is False
