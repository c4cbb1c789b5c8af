"""Updates as goals (5010), whose stream can be joined again (5011): the firmware, and what is reported."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import Firmware, FirmwareState
from roboglot.model.events import Rebooting
from tests.protocols.cyberdog.phone import Client, Stream, until

pytestmark = pytest.mark.world("empty", body="cyberdog2")
MD5 = "0123456789abcdef0123456789abcdef"
PACKAGE = {"version": "1.3.2.0", "packages": [{"md5": MD5, "fileSize": 100_000_000}]}
MODULE = {"module": "l91.NX.OTA", "latest": PACKAGE}
PassTime = Callable[[Callable[[], object]], Awaitable[None]]


@pytest.fixture
def work(client: Client, passing: PassTime) -> Callable[..., Awaitable[list[dict[str, Any]]]]:
    """``await work("download", data=…)``: everything that is answered, to the end of the stream."""

    async def run(operate: str, **fields: object) -> list[dict[str, Any]]:
        stream = Stream(client, 5010, {"id": 7, "operate": operate, **fields})
        await passing(lambda: stream.ended)
        return stream.answers

    return run


@pytest.mark.slow  # in short: test_fetched_and_installed_update_survives_a_crash
async def test_from_what_is_offered_to_what_runs(client, work, robot, forward, app, passing) -> None:
    firmware, gone = robot[Firmware], list[Rebooting]()
    robot.events.listen(Rebooting, gone.append)
    accepted, inquired = await work("inquire")
    assert accepted == {"accepted": 1}
    assert (inquired["id"], inquired["operate"], inquired["code"]) == (7, "inquire", 0)
    assert inquired["data"]["version"] == firmware.version == "1.3.0.0"
    assert inquired["data"]["available"]["version"] == "1.3.1.0"
    assert (await work("upgrade"))[-1]["code"] == 5703  # nothing is downloaded
    accepted, *feedback, result = await work("download", data=[MODULE])
    assert accepted == {"accepted": 1}
    assert {one["state"] for one in feedback} == {"downloading", "downloaded"}
    assert [one["progress"] for one in feedback] == sorted(one["progress"] for one in feedback)
    assert result["code"] == 0
    assert result["data"] == {"version": "1.3.2.0", "md5": MD5}
    assert (await work("upgrade", data="f" * 32))[-1]["code"] == 5710
    _, *feedback, result = await work("upgrade_and_reboot", data=MD5)
    assert feedback[-1]["state"] == "installed"
    assert result["code"] == 0
    assert not gone  # reported before it shuts down
    await passing(lambda: gone)
    await forward(seconds=30)
    assert firmware.version == "1.3.2.0"
    await passing(lambda: app.of(5007))


async def test_another_stream_takes_a_running_goal_over(client, passing, forward, robot) -> None:
    assert await client.ask(5011) == {"accepted": 3}
    first = Stream(client, 5010, {"id": "a", "operate": "download", "data": MODULE})
    await passing(lambda: len(first.answers) > 3)
    assert await client.ask(5010, {"operate": "disk"}) == {"accepted": 2}
    second = Stream(client, 5011, {})
    await until(lambda: first.ended and len(second.answers) > 1)
    assert second.answers[0] == {"accepted": 1}
    assert second.answers[1] == first.answers[-1]  # repeats the latest feedback
    second.call.cancel()
    await asyncio.gather(second.reading, return_exceptions=True)
    third = Stream(client, 5011, {})
    await passing(lambda: third.ended)
    assert third.answers[-1]["code"] == 0
    assert third.answers[-1]["id"] == "a"
    assert robot[Firmware].progress.state is FirmwareState.DOWNLOADED
    assert await client.ask(5011) == {"accepted": 3}


async def test_download_is_discarded_and_reset_abandons_another(client, work, robot, forward) -> None:
    free = robot[Disk].free
    assert (await work("disk"))[-1]["data"] == {"size": robot[Disk].size, "free": free}
    assert (await work("remove"))[-1]["code"] == 5703
    assert (await work("download", data=MODULE))[-1]["code"] == 0
    assert robot[Disk].free == free - 100_000_000
    assert (await work("remove"))[-1]["code"] == 0
    assert (robot[Disk].free, robot[Firmware].progress.state) == (free, FirmwareState.IDLE)
    assert (await client.ask(5003, {"modules": [MODULE]}))["response"] is True
    await forward(seconds=1)
    assert (await work("download", data=MODULE))[-1]["code"] == 5711
    assert (await work("reset"))[-1]["code"] == 0
    assert (robot[Disk].free, robot[Firmware].progress.state) == (free, FirmwareState.IDLE)


@pytest.mark.slow
async def test_goals_that_cannot_be_reached(client, work, robot) -> None:
    for wrong in ({}, {"operate": "format"}, {"operate": ["disk"]}, {"operate": "_run"}, "[]"):
        assert await client.ask(5010, wrong) == {"accepted": 2}
    assert (await work("download", data={"module": 5}))[-1]["code"] == 5710
    assert (await work("download", data=[]))[-1]["data"]["version"] == "1.3.1.0"  # the maker's package
    robot[Battery].set_charge(0.1)
    result = (await work("upgrade"))[-1]
    assert result["code"] == 5701
    assert "battery" in result["message"]
    robot[Disk].rubbish = robot[Disk].free - 1000
    assert (await work("download", data={**MODULE, "latest": {**PACKAGE, "packages": [
        {"md5": MD5, "fileSize": 10**9}]}}))[-1]["code"] == 5701  # fmt: skip
    assert (await work("reboot"))[-1] == {
        "id": 7, "operate": "reboot", "code": 0, "message": "", "data": {"seconds": 3.0},
    }  # fmt: skip


async def test_lost_app_ends_stream_and_not_the_work(client, app, passing, robot) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    files = [{"md5": MD5, "fileSize": 160_000_000}]  # after eight seconds
    module = {**MODULE, "latest": {**PACKAGE, "packages": files}}
    stream = Stream(client, 5010, {"operate": "download", "data": module})
    await passing(lambda: stream.answers)
    app.silent = True
    await passing(lambda: stream.ended)
    assert "code" not in stream.answers[-1]
    assert robot[Firmware].progress.state is FirmwareState.DOWNLOADING
    joined = Stream(client, 5011, {})
    await passing(lambda: joined.ended)
    assert joined.answers[-1]["code"] == 0


@pytest.mark.world("empty", body="robomaster_ep")
async def test_a_robot_without_firmware_of_its_own(client) -> None:
    assert await client.ask(5010, {"operate": "disk"}) == {"error_code": 322}
    assert await client.ask(5011) == {"error_code": 322}
