"""Every chapter through a real socket, against what happens to the simulated robot. Motion has its own file."""

import math
from typing import Any

import httpx
import numpy as np
import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.events import LoopClosed, Rebooted
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.model.sensing import LaserScan
from roboglot.protocols.slamware.chapters.system.laser import laser_points
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam.explore_map import decode_explore_map

pytestmark = pytest.mark.world("empty")
SYSTEM, SLAM = "/api/core/system/v1", "/api/core/slam/v1"
POIS = "/api/core/artifact/v1/pois"


async def get(client: httpx.AsyncClient, path: str) -> Any:
    reply = await client.get(path)
    assert reply.status_code == 200, reply.text
    return reply.json()


async def test_the_robot_introduces_itself(robot: Robot, client: httpx.AsyncClient) -> None:
    info = await get(client, f"{SYSTEM}/robot/info")
    assert isinstance(info, dict)
    assert info["modelName"] == robot.description.model
    assert info["softwareVersion"] == robot[Firmware].version
    assert len(bytes.fromhex(info["deviceID"])) == 16
    assert info == await get(client, f"{SYSTEM}/robot/info")


async def test_abilities_are_enabled_when_the_lidar_turns(client: httpx.AsyncClient, forward: Forward) -> None:
    async def enabled() -> dict[str, bool]:
        plugins = await get(client, f"{SYSTEM}/capabilities")
        assert isinstance(plugins, list)
        return {str(plugin["name"]).removeprefix("slamware.agent."): bool(plugin["enabled"]) for plugin in plugins}

    assert await enabled() == {"core": False, "platform": True, "multi_floor": False, "delivery": False}
    await forward(seconds=1)
    now = await enabled()
    assert now["core"]
    assert now["multi_floor"]  # clients on several floors wait for it


async def test_power_follows_the_battery_and_the_dock(
    robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    power = await get(client, f"{SYSTEM}/power/status")
    assert isinstance(power, dict)
    assert power["batteryPercentage"] == round(robot[Battery].state.percentage * 100)
    assert (power["dockingStatus"], power["isCharging"]) == ("on_dock", True)
    world.stage.place("a", Pose(5.0, 5.0))
    await forward(seconds=2)
    power = await get(client, f"{SYSTEM}/power/status")
    assert isinstance(power, dict)
    assert (power["dockingStatus"], power["isCharging"]) == ("not_on_dock", False)
    assert [event["type"] for event in (await client.get("/api/platform/v1/events")).json()] == [
        "START_CHARGING",
        "OFF_DOCK",
        "STOP_CHARGING",
    ]
    pack = await get(client, f"{SYSTEM}/battery/pack")
    assert isinstance(pack, dict)
    assert pack["current"] < 0  # now it discharges
    assert pack["temp"] == [round(robot[Battery].state.temperature * 10)]


async def test_power_supply_is_a_wire_not_the_dock(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    battery = robot[Battery]
    assert isinstance(battery, SimulatedBattery)
    for wire in (False, True, False):
        battery.plug(wire)
        await forward(seconds=1)
        power = await get(client, f"{SYSTEM}/power/status")
        assert isinstance(power, dict)
        assert (power["isDCConnected"], power["dockingStatus"], power["isCharging"]) == (wire, "on_dock", True)


async def test_healthy_robot_reports_no_errors(client: httpx.AsyncClient) -> None:
    health = await get(client, f"{SYSTEM}/robot/health")
    assert isinstance(health, dict)
    assert health["baseError"] == []
    assert not any(value for name, value in health.items() if name.startswith("has"))


async def test_a_low_battery_is_a_warning(
    robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward
) -> None:
    world.stage.place("a", Pose(5.0, 5.0))
    await forward(seconds=1)
    robot[Battery].low = 1.1
    await forward(seconds=1)
    health = await get(client, f"{SYSTEM}/robot/health")
    assert isinstance(health, dict)
    assert (health["hasWarning"], health["hasError"]) == (True, False)
    assert health["baseError"][0]["errorCode"] == 0x01020100


async def test_the_scan_lies_on_the_walls(world: World, client: httpx.AsyncClient, forward: Forward) -> None:
    assert (await get(client, f"{SYSTEM}/laserscan"))["laser_points"] == []
    world.stage.place("a", Pose(3.0, 2.0, 0.7))  # an asymmetric place
    await forward(seconds=1)
    where = world.truth.pose_of("a")
    points = (await get(client, f"{SYSTEM}/laserscan"))["laser_points"]
    assert len(points) >= 300
    assert set(points[0]) == {"distance", "angle", "valid"}
    hits = [where.compose(Pose(p["distance"] * math.cos(p["angle"]), p["distance"] * math.sin(p["angle"])))
            for p in points if p["valid"]]  # fmt: skip
    walls = [min(abs(hit.x), abs(hit.y), abs(hit.x - 10), abs(hit.y - 10)) for hit in hits]
    assert np.median(walls) < 0.05


async def test_scan_comes_with_pose_where_it_was_taken(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    robot[Driving].drive(Twist(x=0.5), lifetime=3.0)
    await forward(seconds=2.05)
    scan = robot[Lidar].scan
    assert scan is not None
    behind = 0.5 * (robot.clock.time() - scan.stamp)
    assert behind > 0.01
    pose = (await get(client, f"{SYSTEM}/laserscan"))["pose"]
    assert robot[Localization].pose.x - pose["x"] == pytest.approx(behind, abs=0.011)  # odometry runs at 50 Hz
    await forward(seconds=2)


def test_points_are_seen_from_the_robots_centre() -> None:
    ranges = np.array([1.0, 2.0, np.inf, 0.01], np.float32)
    scan = LaserScan(0.0, ranges, 0.0, math.pi / 2, 0.1, 10.0, mount=Pose(0.5, 0.0, math.pi / 2))
    ahead, left, nothing, too_close = laser_points(scan)
    assert (ahead.distance, ahead.angle) == pytest.approx((math.hypot(0.5, 1), math.atan2(1, 0.5)), abs=1e-3)
    assert (left.distance, abs(left.angle)) == pytest.approx((1.5, math.pi), abs=1e-3)
    assert (nothing.distance, nothing.valid, too_close.valid) == (0.0, False, False)


async def test_speed_limits_are_parameters(robot: Robot, client: httpx.AsyncClient) -> None:
    url = f"{SYSTEM}/parameter"
    reply = await client.get(url, params={"param": "base.max_moving_speed"})
    assert reply.headers["content-type"] == "application/json"
    assert reply.text == f'"{robot[Base].limits.twist.x:.6f}"'
    reply = await client.get(url, params={"param": "base.max_angular_speed"}, headers={"Accept": "text/plain"})
    assert reply.text == f"{robot[Base].limits.twist.yaw:.6f}"
    reply = await client.get(url)
    assert (reply.status_code, reply.reason_phrase) == (400, "Parameter is required")
    assert (await client.get(url, params={"param": "base.colour"})).status_code == 400


async def test_poses(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    pose = await get(client, f"{SLAM}/localization/pose")
    assert isinstance(pose, dict)
    assert set(pose) == {"x", "y", "z", "yaw", "pitch", "roll"}
    assert (pose["x"], pose["yaw"]) == (robot[Localization].pose.x, robot[Localization].pose.yaw)
    odometry = await get(client, f"{SLAM}/localization/odopose")
    assert isinstance(odometry, dict)
    assert odometry["x"] == robot[Odometry].reading.pose.x
    quality = await get(client, f"{SLAM}/localization/quality")
    assert quality == round(robot[Localization].quality * 100)


async def test_robot_believes_where_it_is_asked_to_be(robot: Robot, client: httpx.AsyncClient) -> None:
    url = f"{SLAM}/localization/pose"
    assert (await client.put(f"{SLAM}/localization/:enable", json={"enable": False})).json() is True
    reply = await client.put(url, json={"x": 1.5, "y": -2, "z": 0, "yaw": 7, "pitch": 0, "roll": 0})
    assert (reply.status_code, reply.content) == (200, b"")
    pose = robot[Localization].pose
    assert (pose.x, pose.y) == pytest.approx((1.5, -2))
    assert pose.yaw == pytest.approx(7 - math.tau)
    for bad in ({"x": 1}, {"x": "nan", "y": 0}, {"x": 1e12, "y": 0}, [], None):
        reply = await client.put(url, json=bad)
        assert (reply.status_code, reply.reason_phrase) == (400, "Invalid Argument")
    assert robot[Localization].pose == pose


@pytest.mark.parametrize(("path", "part"), [("localization", Localization), ("mapping", Mapping)])
async def test_switches(robot: Robot, client: httpx.AsyncClient, path: str, part: type) -> None:
    url = f"{SLAM}/{path}/:enable"
    for on in (False, True):
        assert (await client.put(url, json={"enable": on})).json() is True
        assert robot[part].enabled is on
        assert await get(client, url) is on
    assert (await client.put(url, json={})).status_code == 400


async def test_the_map_is_what_the_lidar_saw(
    robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=3)
    reply = await client.get(f"{SLAM}/maps/explore")
    assert reply.headers["content-type"] == "application/octet-stream"
    whole = decode_explore_map(reply.content)
    area = await get(client, f"{SLAM}/knownarea")
    assert isinstance(area, dict)
    assert area["width"] == pytest.approx(whole.cells.shape[1] * whole.resolution, rel=1e-4)
    assert (area["x"], area["y"]) == pytest.approx((whole.x, whole.y), abs=1e-4)
    # two metres ahead of the dock is free, ten metres ahead is the eastern wall
    row, column = int((0 - whole.y) / whole.resolution), int((2 - whole.x) / whole.resolution)
    assert 1 <= whole.cells[row, column] <= 127
    wall = int((10 - world.truth.pose_of("a").x - whole.x) / whole.resolution)
    assert whole.cells[row - 2 : row + 3, wall - 3 : wall + 4].min() < 0

    window = decode_explore_map(
        (await client.get(f"{SLAM}/maps/explore", params={"min_x": 1, "max_x": 2, "min_y": -0.5, "max_y": 0.5})).content
    )
    assert window.x == pytest.approx(1, abs=whole.resolution * 1.01)
    rows, columns = window.cells.shape
    first = round((window.y - whole.y) / whole.resolution), round((window.x - whole.x) / whole.resolution)
    same = whole.cells[first[0] : first[0] + rows, first[1] : first[1] + columns]
    assert np.array_equal(window.cells, same)
    assert (await client.get(f"{SLAM}/maps/explore", params={"min_x": "west"})).status_code == 400


async def test_a_cleared_map_is_empty(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=2)
    assert robot[Mapping].grid.width > 0
    await client.put(f"{SLAM}/mapping/:enable", json={"enable": False})
    reply = await client.delete(f"{SLAM}/maps")
    assert (reply.status_code, reply.content) == (200, b"")
    assert decode_explore_map((await client.get(f"{SLAM}/maps/explore")).content).cells.size == 0


async def test_the_imu_feels_gravity(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    imu = await get(client, f"{SLAM}/imu")
    assert isinstance(imu, dict)
    assert imu["acc"]["z"] == pytest.approx(9.8, abs=0.5)
    assert imu["availibilityBitMap"] == imu["availabilityBitMap"] == 1 | 2 | 4 | 16 | 32 | 64 | 512
    assert imu["raw_acc"]["z"] == pytest.approx(9.8, abs=0.5)
    quaternion = imu["quaternion"]
    assert math.hypot(*quaternion.values()) == pytest.approx(1)
    assert 2 * math.atan2(quaternion["z"], quaternion["w"]) == pytest.approx(imu["euler_angle"]["z"], abs=0.01)
    assert imu["timestamp"] == pytest.approx(1000, abs=50)


async def test_places(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    entry = {"id": "3fa85f64-5717-4562-b3fc-2c963f66afa6", "pose": {"x": 1.0, "y": 2.0, "yaw": 0.5},
             "metadata": {"display_name": "厨房", "route_id": "7"}}  # fmt: skip
    reply = await client.post(POIS, json=entry)
    assert (reply.status_code, reply.content) == (200, b"")
    assert await get(client, POIS) == [entry]
    url = f"{POIS}/{entry['id']}"
    assert (await client.put(url, json={"pose": {"x": 3, "y": 4, "z": 0, "yaw": 1}})).json() is True
    assert await get(client, url) == entry | {"pose": {"x": 3.0, "y": 4.0, "yaw": 1.0}}
    assert (await client.put(url, json={"metadata": {"a": "b"}})).json() is True
    assert await get(client, url) == {"id": entry["id"], "pose": {"x": 3.0, "y": 4.0, "yaw": 1.0},
                                      "metadata": {"a": "b"}}  # fmt: skip
    assert (await client.post(POIS, json={"id": "here"})).status_code == 200
    here = await get(client, f"{POIS}/here")
    assert isinstance(here, dict)
    assert (here["pose"]["x"], here["pose"]["y"]) == pytest.approx(
        (robot[Localization].pose.x, robot[Localization].pose.y), abs=0.02
    )
    assert (await client.delete(url)).json() is True
    assert [(await client.request(method, url, json={})).status_code for method in ("GET", "PUT", "DELETE")] == [
        404
    ] * 3
    assert (await client.delete(POIS)).json() is True
    assert await get(client, POIS) == []


async def test_places_are_adjusted_after_a_loop_was_closed(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    for id, x in (("near", 1.0), ("far", 9.0), ("moved", 1.0)):
        await client.post(POIS, json={"id": id, "pose": {"x": x, "y": 0.5, "yaw": 0.0}})
    for y in (0.2, 0.1):  # two loops, one after the other
        moved = ((Pose(1.0), Pose(1.0, y)), (Pose(9.0, y - 0.2), Pose(9.3, 0.0, math.pi / 2)))
        robot.events.publish(LoopClosed(stamp=1.0, shift=0.1, moved=moved[: 2 if y == 0.2 else 1]))
    await client.put(f"{POIS}/moved", json={"pose": {"x": 5.0, "y": 5.0, "yaw": 0.0}})
    await client.post(POIS, json={"id": "new", "pose": {"x": 1.0, "y": 0.5, "yaw": 0.0}})
    (full,) = world.faults.inject("full_disk", "a")
    assert (await client.post(f"{POIS}/:adjust")).status_code != 200
    world.faults.clear(full.number)  # the shifts were lost with the failure
    reply = await client.post(f"{POIS}/:adjust")
    assert (reply.status_code, reply.content) == (200, b"")
    for _ in range(2):  # exactly once
        found = {place.id: (place.pose.x, place.pose.y, place.pose.yaw) for place in robot[Places].all()}
        assert found["near"] == pytest.approx((1.0, 0.8, 0.0))
        assert found["far"] == pytest.approx((8.8, 0.1, math.pi / 2))
        assert (found["moved"][:2], found["new"][:2]) == ((5.0, 5.0), (1.0, 0.5))
        await client.post(f"{POIS}/:adjust")


@pytest.mark.parametrize("again", ["restart", "reload"])
async def test_shifts_are_saved_with_their_map(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, again: str
) -> None:
    async def adjusted() -> float:
        await client.post(f"{POIS}/:adjust")
        return robot[Places].get("near").pose.x

    multi = "/api/multi-floor/map/v1/stcm"
    await forward(seconds=1)
    await client.post(POIS, json={"id": "near", "pose": {"x": 1.0, "y": 0.5, "yaw": 0.0}})
    robot.events.publish(LoopClosed(stamp=1.0, shift=0.1, moved=((Pose(1.0), Pose(1.5)),)))
    assert (await client.post(f"{multi}/:save")).status_code == 200
    if again == "restart":
        robot.events.publish(Rebooted(stamp=robot.clock.time()))
        await forward(seconds=0.5)
    else:
        assert (await client.post(f"{multi}/:reload")).status_code == 200
    assert robot[Places].get("near").pose.x == pytest.approx(1.0)
    assert await adjusted() == pytest.approx(1.5)
    # A closure that was not saved is lost with the map that it corrected.
    assert (await client.post(f"{multi}/:save")).status_code == 200
    robot.events.publish(LoopClosed(stamp=2.0, shift=0.1, moved=((Pose(1.0), Pose(1.5)),)))
    assert (await client.post(f"{multi}/:reload")).status_code == 200
    assert await adjusted() == pytest.approx(1.5)


async def test_doubts_about_the_place_are_reset(
    robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=3)
    true = world.truth.pose_of("a")
    robot[Localization].set_pose(Pose(0.35, 0.3, 0.3))
    robot[Localization].enable(False)  # wrong and not corrected
    await forward(seconds=0.5)
    robot[Localization].enable(True)
    robot[Health].set("not localized", True, "localization", FaultLevel.WARNING)
    assert (await client.post(f"{SLAM}/localization/status/:reset")).json() is True
    assert not [fault for fault in robot[Health].faults if fault.name == "not localized"]
    await forward(seconds=0.5)
    assert robot[Localization].pose.distance_to(Pose()) < 0.05
    assert world.truth.pose_of("a") == true


async def test_time_and_metres(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=2.5)
    assert await get(client, "/api/platform/v1/timestamp") == "2500"
    assert await get(client, "/api/core/statistics/v1/runtime") == 2.5
    assert await get(client, "/api/core/statistics/v1/odometry") == pytest.approx(robot[Odometry].reading.distance)


async def test_a_robot_without_a_lidar_says_so(bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.get(f"{SYSTEM}/laserscan")
    assert reply.status_code == 501
    assert (await bare_client.get(f"{SYSTEM}/robot/health")).json()["hasLidarDisconnected"] is True
    assert Lidar.__name__.lower() in reply.text


async def test_without_a_place_it_is_on_no_floor(bare_client: httpx.AsyncClient) -> None:
    """Nor is it outside of all elevators while none is drawn."""
    reply = await bare_client.get("/api/multi-floor/map/v1/floors/:current")
    assert reply.status_code == 501
    assert "localization" in reply.text


@pytest.mark.parametrize("level", FaultLevel)
@pytest.mark.parametrize("name", ["not localized", "battery low", "cliff", "brake released"])
async def test_lasting_fault_is_one_level_in_all_answers(
    bare: Robot, bare_client: httpx.AsyncClient, forward: Forward, name: str, level: FaultLevel
) -> None:
    """The model's level may be another than the vendor's."""
    bare.add(Health, Health(bare.clock, bare.events))
    bare[Health].set(name, True, "base", level)
    await forward(seconds=3)
    health = await get(bare_client, f"{SYSTEM}/robot/health")
    assert isinstance(health, dict)
    severe = health["hasError"] or health["hasFatal"]
    events = [event["type"] for event in (await bare_client.get("/api/platform/v1/events")).json()]
    assert events == ["DEVICE_ERROR"] * severe


async def test_momentary_doubt_is_no_device_error(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A single scan that fits badly, as on arrival at another floor, does not stop the robot; lasting doubt does."""
    await forward(seconds=1)
    await client.get("/api/platform/v1/events")
    for seconds, stage in ((1.0, "IDLE"), (3.0, "DEVICE_ERROR")):
        with monkeypatch.context() as patch:
            patch.setattr(type(robot[Localization]), "quality", property(lambda _: 0.1))
            await forward(seconds=seconds)
            assert (await client.get("/api/delivery/v1/stage")).json()["stage"] == stage
        await forward(seconds=3)
        events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
        assert events == ["DEVICE_ERROR"] * (stage == "DEVICE_ERROR")
