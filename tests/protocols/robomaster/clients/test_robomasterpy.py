"""An unmodified client that people use, on the vendor's ports."""

import asyncio
import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.testing.addresses import free_addresses

TOUR = Path(__file__).with_name("robomasterpy_tour.py")


async def listen(tour: asyncio.subprocess.Process, said: list[str], touch: Callable[[], None]) -> bytes:
    """Collect its output line by line, and touch the robot when it asks; return its errors at the end."""
    assert tour.stdout
    assert tour.stderr
    while line := (await tour.stdout.readline()).decode().strip():
        said.append(line)
        if line == "TOUCH ME":
            touch()
    errors = await tour.stderr.read()
    await tour.wait()
    return errors


def check(said: list[str], address: str, *, late: bool = False) -> None:
    """Everything that the tour saw is as it should be, behind ``address``.

    ``late``: what is pushed comes after a while, so that the last pushes may be of what was switched off by then.
    """
    seen = json.loads(next(line for line in said if line.startswith("SEEN "))[5:])
    assert seen.pop("position")[:2] == pytest.approx((0.3, 0.1), abs=0.03)
    pitch, roll, yaw = seen.pop("attitude")
    assert (pitch, roll) == pytest.approx((0, 0), abs=1)
    assert yaw == pytest.approx(30, abs=3)
    if late:
        seen["pushed"] = sorted({*seen["pushed"], "GimbalAttitude"})
    assert seen == {
        "broadcast": address,
        "ip": address,
        "version": "version 00.00.00.70",
        "mode at first": "chassis_lead",
        "mode set": "ok",
        "mode then": "free",
        "move": "ok",
        "speed": "ok",
        "moving": True,
        "wheel": "ok",
        "push on": "ok",
        "pushed": ["ChassisAttitude", "ChassisPosition", "ChassisStatus", "GimbalAttitude"],
        "gimbal push": "ok",
        "gimbal push off": "ok",
        "gimbal": ["ok"] * 4,
        "aimed": True,
        "gimbal more": ["ok"] * 3,
        "armor": ["ok", 10, "ok"],
        "sound": "ok",
        "led": "ok",
        "ir on": "ok",
        "fire": "ok",
        "event": [1, 2],
        "audio": ["ok", "ok"],
        "stream": "ok",
        "frame": [720, 1280, 3],
        "stream off": "ok",
        "push off": "ok",
        "quit": "ok",
    }


@pytest.mark.world("office", body="robomaster_ep")
async def test_robomasterpy_works_unmodified(robot, world, forward, vendor_ports) -> None:
    address = free_addresses(1)
    door = RoboMasterDoor(robot, address, RoboMasterConfig())
    await door.start()
    tour = await asyncio.create_subprocess_exec(
        sys.executable, str(TOUR), address, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
    )
    said: list[str] = []
    ended = asyncio.ensure_future(listen(tour, said, lambda: world.stage.touch_plate("a", PlatePlace.REAR)))
    try:
        async with asyncio.timeout(200):  # the whole tour, on a busy machine
            while not ended.done():
                await forward(seconds=0.05)
                await asyncio.sleep(0.002)
        errors = await ended
    finally:
        if tour.returncode is None:
            tour.kill()
            await ended
        await door.close()
    assert tour.returncode == 0, errors.decode()
    check(said, address)
    assert robot[Odometry].reading.pose.x > 0.25
