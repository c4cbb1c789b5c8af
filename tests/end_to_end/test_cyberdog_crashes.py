"""The robot, or the app, is killed amid a mapping, a file transfer, an update: nothing acknowledged is lost."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from roboglot.clients.cyberdog import Certificates, CyberDogClient
from roboglot.clients.cyberdog.values import FilesLeft, Grid, Label, UpdateProgress
from roboglot.clients.errors import ClientError
from roboglot.testing.addresses import free_addresses, free_port
from roboglot.testing.process import ServedRobot, served
from roboglot.wire.cyberdog.codes import TaskType

ADDRESS = free_addresses(1)
PATIENCE = 60.0  # s
FILE = {"version": "1.3.2.0", "type": "FULL_PACKAGE", "md5": "0" * 32, "fileSize": 900_000_000, "fileName": "dog.zip"}
SMALL = {**FILE, "fileSize": 30_000_000}  # 1.5 s to fetch, 3 s to install
MODULE = {"product": "l91", "device": "l91.NX", "module": "l91.NX.OTA",
          "current": {"version": None}, "latest": {"version": "1.3.2.0", "packages": [FILE]}}  # fmt: skip


@asynccontextmanager
async def talking(data: Path) -> AsyncIterator[tuple[ServedRobot, CyberDogClient]]:
    """Yield a robot on ``data``, and a client that it has found."""
    port = free_port()
    arguments = ("--robot", "a=cyberdog2", "--world", "playground", "--app", f"127.0.0.1:{port}")
    with served(data, *arguments, address=ADDRESS) as robot:
        async with CyberDogClient(ADDRESS, certificates(data), app_port=port) as dog, asyncio.timeout(PATIENCE):
            await dog.found()
            yield robot, dog


def certificates(data: Path) -> Certificates:
    return Certificates.load(data / "cyberdog" / "tls")


def kill(robot: ServedRobot) -> None:
    robot.process.send_signal(signal.SIGKILL)
    robot.process.wait()


@pytest.mark.slow  # kills and restarts programs in real time; tests/storage has what survives
async def test_the_robot_is_killed_in_the_middle(tmp_path: Path) -> None:
    data = tmp_path / "data"
    async with talking(data) as (robot, dog):
        with dog.watch(Grid) as grids:
            await dog.map_surroundings()
            while (await anext(grids)).width < 50:
                pass
        await dog.save_map("home")
        await dog.set_labels("home", [Label("door", 0.5, 0.25)])
        await dog.keep_photo()
        await dog.download_update([MODULE])
        mapping = await dog.map_surroundings()
        kill(robot)
        with pytest.raises(ClientError):
            await dog.status()
        mapping.leave()
    async with talking(data) as (robot, dog):
        found = await dog.get_map()
        assert (found.mapName, found.locationLabelInfo) == ("home", [Label("door", 0.5, 0.25)])
        assert (await dog.status())["task_status"]["task_status"] == 101
        with dog.watch(FilesLeft) as left:
            (name,) = (await anext(left)).file_name
        call = dog.link.fetch(4004, f'{{"file_name": "{name}"}}')
        await anext(call)
        kill(robot)  # in the middle of the transfer, or after its only chunk
        await call.aclose()
    async with talking(data) as (robot, dog):
        await (await dog.relocalise())
        assert (await dog.update_status()).status == "idle"
        await dog.stop_task()
        async with the_app_is_killed_while_mapping(dog, data) as again:
            await again.download_update([{**MODULE, "latest": {"version": "1.3.2.0", "packages": [SMALL]}}])
            with again.watch(UpdateProgress) as reported:
                while (await anext(reported)).download_progress < 100:
                    pass
                await again.install_update(str(SMALL["md5"]))
                while (await anext(reported)).upgrade_progress < 20:
                    pass
            kill(robot)
    async with talking(data) as (_, dog):
        assert (await dog.get_map()).mapName == "attic"
        progress = await dog.update_progress()
        assert (progress.download_progress, progress.upgrade_progress) == (100, 0)  # the fetched files are there
        await dog.install_update(str(SMALL["md5"]))  # and the normal flow goes on
        assert (await dog.update_status()).status == "update"


@asynccontextmanager
async def the_app_is_killed_while_mapping(dog: CyberDogClient, data: Path) -> AsyncIterator[CyberDogClient]:
    """Another one joins the task that went on, and saves the map."""
    with dog.watch(Grid) as grids:
        mapping = await dog.map_surroundings()
        while (await anext(grids)).width < 50:
            pass
    mapping.leave()
    await dog.close()  # without notice to the robot
    async with CyberDogClient(ADDRESS, certificates(data), app_port=dog.link.app_port) as again:
        await again.found()
        assert (await again.status())["task_status"]["task_status"] == 5
        joined = await again.join(TaskType.MAPPING)
        assert joined.feedback in (0, 6)
        await again.save_map("attic")
        await joined
        yield again
