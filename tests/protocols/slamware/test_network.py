"""Wi-Fi, routes, the modem and the raw IMU through a real socket, judged by the robot's parts."""

from __future__ import annotations

import math
from typing import Any

import httpx
import pytest

from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.network import Network, Uplink
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.testing import Forward

SYSTEM = "/api/core/system/v1"
STATUS, ROUTE, APN = (f"{SYSTEM}/network/{name}" for name in ("status", "route", "apn"))
pytestmark = pytest.mark.world("office", body="hermes")


async def status(client: httpx.AsyncClient) -> Any:
    return (await client.get(STATUS)).json()["networkstatus"]


async def put(client: httpx.AsyncClient, mode: int, **options: str) -> httpx.Response:
    return await client.put(STATUS, json={"networkmode": mode, "options": options})


async def test_the_way_from_one_network_to_another(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    at_first = await status(client)
    state = robot[Network].state
    assert (at_first["mode"], at_first["ssid"], at_first["ip"]) == ("STA", state.ssid, state.address)
    assert (at_first["mac"], at_first["ethip1"]) == (state.mac, "192.168.11.1/24")
    assert 0 < at_first["quality"] <= 100
    assert (await put(client, 1, ssid="office-guests", password="")).json() is True
    await forward(seconds=5)
    assert (await status(client))["ssid"] == robot[Network].state.ssid == "office-guests"
    await put(client, 1, ssid="nowhere", password="12345678")
    await forward(seconds=6)
    assert (await status(client))["ssid"] == "office-guests"  # not scanned: as before
    assert (await put(client, 2)).json() is True
    await forward(seconds=1)
    off = await status(client)
    assert (off["ssid"], off["ip"], off["quality"]) == ("", "", 0)


async def test_options_may_be_an_empty_list(client: httpx.AsyncClient) -> None:
    """The manual's own example."""
    assert (await client.put(STATUS, json={"networkmode": 0, "options": []})).json() is True
    assert (await client.put(STATUS, json={"networkmode": 0, "options": ["ssid"]})).status_code == 400


async def test_an_access_point(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    assert (await put(client, 0)).json() is True
    await forward(seconds=1)
    own = await status(client)
    assert (own["mode"], own["ip"], own["quality"]) == ("AP", "192.168.11.1", 100)
    assert own["ssid"].startswith("Slamware-")
    assert (await put(client, 0, ssid="Bistro", password="12345678")).json() is True
    assert robot[Network].state.ssid == (await status(client))["ssid"] == "Bistro"


async def test_dhcp_is_switched(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    for mode, on in ((3, False), (4, True)):
        assert (await put(client, mode)).json() is True
        assert robot[Network].state.dhcp is on


async def test_nonsense_is_refused(client: httpx.AsyncClient) -> None:
    for mode, options in ((5, {}), (1, {"ssid": "x"}), (1, {}), (0, {"ssid": "x" * 40}), (0, {"password": "short"})):
        assert (await put(client, mode, **options)).status_code == 400
    assert (await client.put(ROUTE, json={"priority": "pigeon"})).status_code == 400
    assert (await client.put(APN, json={"apn": ""})).status_code == 400


async def test_routes(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    assert (await client.get(ROUTE)).json() == {"priority": "wifi"}
    assert robot[Network].state.route is Uplink.WIFI
    reply = await client.put(ROUTE, json={"priority": "4g"})
    assert (reply.status_code, reply.content) == (200, b"")
    assert robot[Network].state.route is Uplink.MOBILE
    assert (await client.get(ROUTE)).json() == {"priority": "4g"}


async def test_the_operators_access_point(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    assert (await client.get(APN)).json() == {"apn": "cmnet"}
    assert (await client.put(APN, json={"apn": "nonsense"})).status_code == 200
    assert (await client.get(APN)).json() == {"apn": "nonsense"}
    mobile = robot[Network].mobile
    assert mobile is not None
    assert not mobile.registered  # this operator has no such name


@pytest.mark.world("office", body="cyberdog2")
async def test_a_robot_without_a_modem(client: httpx.AsyncClient) -> None:
    assert (await client.get(APN)).status_code == 501
    assert (await client.put(APN, json={"apn": "cmnet"})).status_code == 501
    assert (await client.put(ROUTE, json={"priority": "4g"})).status_code == 501


async def test_the_raw_imu_feels_gravity_and_turning(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    async def read(name: str) -> Any:
        return (await client.get(f"{SYSTEM}/{name}")).json()

    await forward(seconds=1)
    counts, values = await read("rawadcimu"), await read("rawimu")
    assert all(isinstance(value, int) for value in counts.values())
    assert counts["timestamp"] == values["timestamp"] == pytest.approx(1000, abs=40)
    assert math.hypot(values["acc_x"], values["acc_y"], values["acc_z"]) == pytest.approx(9.8, abs=0.5)
    assert counts["acc_z"] * values["acc_z"] > 0
    field = math.hypot(values["comp_x"], values["comp_y"], values["comp_z"])
    assert 10 < field < 200  # microtesla
    robot[Driving].move_by(Pose(0.6))
    await forward(seconds=4)
    robot[Driving].move_by(Pose(yaw=2.0))
    await forward(seconds=1.5)
    turning, turning_counts = await read("rawimu"), await read("rawadcimu")
    assert turning["gyro_z"] > 0.3
    assert turning_counts["gyro_z"] > counts["gyro_z"]
