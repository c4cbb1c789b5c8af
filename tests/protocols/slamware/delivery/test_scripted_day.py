"""A day of a delivery robot from the first map to the new firmware, as its clients see it, on the virtual clock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.system.firmware import Firmware, FirmwareState
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose
from roboglot.wire.slamware.chapters.slam import stcm_layers
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer, decode_stcm, encode_stcm
from tests.protocols.slamware.screen import Screen

CORE, MULTI = "/api/core", "/api/multi-floor/map/v1"
ACTIONS, SYSTEM = f"{CORE}/motion/v1/actions", f"{CORE}/system/v1"
ARTIFACT, SLAM = f"{CORE}/artifact/v1", f"{CORE}/slam/v1"
LIFT = "9b0c0d6e-0000-4000-8000-000000000001"
FRONT, BACK = Point(1.75, 3.0), Point(0.15, 3.0)  # of the car, in the world


RIDE = [
    "WAIT_ELEVATOR",
    "ENTER_ELEVATOR_PATH_FOUND",
    "ENTER_ELEVATOR",
    "IN_ELEVATOR",
    "LEAVE_ELEVATOR",
    "OUT_OF_ELEVATOR",
]
EVENTS = {
    "mapping": ["START_CHARGING", "OFF_DOCK", "STOP_CHARGING"],
    "restart": ["ROBOT_REBOOT"],
    "the first order": ["DELIVERY_TASK_START"],
    "the second, upstairs": ["DELIVERY_TASK_START", *RIDE, "DELIVERY_NO_PICKUP", "BACK_TO_RECEPTION_FOR_FAILED_ORDER"],
    "its way back": ["DELIVERY_TASK_START", *RIDE],
    "the third": ["DELIVERY_TASK_START", "LOW_BATTERY", "ON_DOCK", "START_CHARGING"],
    "the night": ["START_TO_WORK", "UPGRADE", "ROBOT_REBOOT"],
}


class Day(Screen):
    """The clients of that day: deployment tool, screen, dashboard."""

    def __init__(self, client: httpx.AsyncClient, forward: Forward, world: World) -> None:
        super().__init__(client, forward, world)
        self.happened: list[str] = []

    def at(self, x: float, y: float) -> Point:
        """Return a place of the world on the map."""
        return Pose(x, y).relative_to(self.origin).point

    async def ask(self, method: str, path: str, body: object = None, *, content: bytes | None = None) -> httpx.Response:
        """Make a request that must succeed; return the response."""
        sent: Any = {"content": content} if body is None else {"json": body}
        reply = await self.client.request(method, path, **sent)
        assert reply.status_code in (200, 204), f"{method} {path}: {reply.status_code} {reply.text}"
        return reply

    async def do(self, name: str, within: float = 120.0, **options: object) -> Any:
        """Carry out an action to its end; return its state."""
        body = {"action_name": f"slamtec.agent.actions.{name}", "options": options}
        number = (await self.ask("POST", ACTIONS, body)).json()["action_id"]
        for _ in range(int(within)):
            await self.forward(seconds=1)
            state = (await self.client.get(f"{ACTIONS}/{number}")).json()["state"]
            if state["status"] == 4:
                assert (state["result"], state["reason"]) == (0, ""), (name, options, state)
                return state
        raise AssertionError(f"{name} has not ended within {within} s")

    async def reported_pose(self) -> Pose:
        """Return the pose that the robot reports."""
        pose = (await self.client.get(f"{SLAM}/localization/pose")).json()
        return Pose(pose["x"], pose["y"], pose["yaw"])

    async def take(self, box: int) -> None:
        """Open the box and empty it, as a customer does."""
        assert await self.say("start_pickup") == 204
        await self.operate(box, ":open")
        await self.forward(seconds=4)

    async def ended(self, number: str, status: str, reason: str, *, within: int = 30) -> None:
        """Wait for a task's end."""
        for _ in range(within):
            task = await self.task(number)
            if task["status"] == status:
                assert task["result"]["reason"] == reason
                return
            await self.forward(seconds=1)
        raise AssertionError(f"{number} has not {status}: {task}")

    async def look(self) -> None:
        """Collect the events since the last look."""
        self.happened += await self.events()


@pytest.fixture
def day(client: httpx.AsyncClient, forward: Forward, world: World) -> Day:
    return Day(client, forward, world)


async def draw(day: Day) -> None:
    """Places, a wall, an area, the lift and the dock."""
    for name, (x, y, kind) in {"R101": (6.0, 4.5, "ROOM"), "desk": (5.0, 1.0, "RECEPTION")}.items():
        place = day.at(x, y)
        metadata = {"display_name": name, "type": kind}
        await day.ask(
            "POST", f"{ARTIFACT}/pois", {"id": name, "pose": {"x": place.x, "y": place.y}, "metadata": metadata}
        )
    a, b = day.at(4.2, 2.4), day.at(4.2, 0.8)
    wall = {"start": {"x": a.x, "y": a.y}, "end": {"x": b.x, "y": b.y}}
    await day.ask("POST", f"{ARTIFACT}/lines/walls", [wall])
    a, b = day.at(6.5, 3.2), day.at(7.5, 3.2)
    slow = {"start": {"x": a.x, "y": a.y}, "end": {"x": b.x, "y": b.y}, "half_width": 0.4}
    await day.ask("POST", f"{ARTIFACT}/rectangle-areas/dangerous_area", {"area": slow, "metadata": {}})
    a, b = day.at(FRONT.x, FRONT.y), day.at(BACK.x, BACK.y)
    car = {"start": {"x": a.x, "y": a.y}, "end": {"x": b.x, "y": b.y}, "half_width": 0.8}
    words = {"elevator_id": LIFT, "elevator_sill_width": "0.3", "elevator_scheduling_point_dist": "0.9"}
    await day.ask("POST", f"{ARTIFACT}/rectangle-areas/elevator_area", {"area": car, "metadata": words})


def storeys(exported: bytes, upstairs: Point) -> bytes:
    """Return a deployment tool's map of two storeys: two alike, with a room on the upper one."""

    def named(layer: Layer, floor: str, order: int) -> Layer:
        label = {"building": "A", "floor": floor, "order": str(order), "default": str(order == 0).lower()}
        kept = tuple((key, value) for key, value in layer.pairs if key not in label)
        return replace(layer, pairs=(*kept, *label.items()))

    lower = decode_stcm(exported).layers
    shared = [layer for layer in lower if layer.metadata["usage"] in ("explore", "rectangle_area", "virtual_walls")]
    words = (("display_name", "U201"), ("type", "ROOM"))
    room = stcm_layers.pose_layer(
        stcm_layers.PLACES, [stcm_layers.PoseEntry("u201", upstairs.x, upstairs.y, 0.0, words)]
    )
    layers = [named(layer, "ground", 0) for layer in lower] + [named(layer, "first", 1) for layer in (*shared, room)]
    return encode_stcm(CompositeMap(tuple(layers)))


async def restart(day: Day) -> None:
    """Off and on; its port is closed meanwhile."""
    await day.ask("POST", f"{SYSTEM}/power/:restartmodule", {"mode": "RestartModeHard"})
    gone = 0
    for _ in range(120):
        await day.forward(seconds=1)
        try:
            await day.client.get(f"{SYSTEM}/power/status")
        except httpx.TransportError:
            gone += 1
            continue
        if gone:
            return
    raise AssertionError("it has not come back")


@pytest.mark.world(str(Path(__file__).parents[1] / "data" / "tower.toml"), body="hermes")
@pytest.mark.slow  # a long story; test_delivery.py has its parts
async def test_a_day(day: Day, robot: Robot, world: World) -> None:  # noqa: PLR0915 - one day
    await day.forward(seconds=2)
    await day.prepare()
    cargo: Any = robot[Cargo]
    battery: Any = robot[Battery]
    # The floor is mapped and the map saved.
    await day.ask("PUT", f"{SLAM}/mapping/:enable", {"enable": True})
    for x, y in ((5.5, 3.0), (3.2, 3.0), (5.5, 4.0)):
        goal = day.at(x, y)
        await day.do("MoveToAction", target={"x": goal.x, "y": goal.y})
    await day.ask("PUT", f"{SLAM}/mapping/:enable", {"enable": False})
    await draw(day)
    await day.ask("POST", f"{MULTI}/stcm/:save")
    await day.look()
    exported = (await day.ask("GET", f"{SLAM}/maps/stcm")).content
    await day.ask("POST", f"{MULTI}/stcm", content=storeys(exported, day.at(6.0, 4.0)))
    here = day.pose
    await day.ask("POST", f"{MULTI}/stcm/:reload", {"pose": {"x": here.x, "y": here.y, "yaw": here.yaw}})
    # It restarts, finds its place in the whole map, and relocalizes.
    await restart(day)
    assert (await day.reported_pose()).distance_to(day.pose) < 0.1
    await day.look()
    await day.do("RecoverLocalizationAction", max_recover_time=30_000, recover_mode="NoMove")
    assert_pose(await day.reported_pose(), x=day.pose.x, y=day.pose.y, within=0.15)
    walls = (await day.client.get(f"{ARTIFACT}/lines/walls")).json()
    assert len(walls) == 1
    # Two orders on two floors: the first is collected, the second is not and returns to the reception.
    for box in (0, 1):
        await day.operate(box, ":open")
    await day.forward(seconds=4)
    for box in (0, 1):
        cargo.put(box, 1.0)
    first = await day.create("R101", "TAKEOUT", 0)
    second = await day.create("U201", "TAKEOUT", 1)
    await day.until("ARRIVED_AT_TARGET", within=90)
    await day.take(0)
    cargo.put(0, 0.0)
    assert await day.say("end_pickup") == 204
    await day.ended(first, "SUCCEEDED", "")
    await day.look()
    await day.until("ON_DELIVERING", within=10)
    await day.until("ARRIVED_AT_TARGET", within=150)
    assert world.truth.floor_of("a") == 1
    await day.ended(second, "FAILED", "NO_PICKUP", within=310)
    await day.look()
    await day.until("ON_DELIVERING", within=10)
    await day.until("ARRIVED_AT_TARGET", within=150)
    assert world.truth.floor_of("a") == 0
    (collect,) = (await day.client.get("/api/delivery/v1/tasks", params={"type": "collect"})).json()
    await day.take(1)
    cargo.put(1, 0.0)
    assert await day.say("end_pickup") == 204
    await day.ended(collect["task"]["order_id"], "SUCCEEDED", "")
    await day.look()
    # The battery runs low on the way: the task ends, and the robot charges.
    third = await day.create("R101", "RETURN")
    await day.until("ON_DELIVERING", within=10)
    await day.forward(seconds=2)
    battery.set_charge(0.09)
    await day.ended(third, "CANCELED", "LOW_BATTERY", within=10)
    await day.until("IDLE", within=90)
    assert robot[DockContact].docked
    await day.forward(seconds=3)
    await day.look()
    # Charged, it installs the night's firmware.
    battery.set_charge(0.85)
    await day.forward(seconds=3)
    new = (await day.client.get(f"{CORE}/firmware/v1/newversion")).json()["firmware"]
    await day.ask("POST", f"{CORE}/firmware/v1/autoupdate/:start")
    for _ in range(200):
        await day.forward(seconds=1)
        if robot[Firmware].progress.state is FirmwareState.INSTALLING:
            await day.look()  # what is unread does not outlive the restart
        if robot[Firmware].version == new:
            break
    await day.forward(seconds=30)
    assert (await day.client.get(f"{SYSTEM}/robot/info")).json()["softwareVersion"] == new
    assert {place["id"] for place in (await day.client.get(f"{ARTIFACT}/pois")).json()} == {"R101", "desk"}
    await day.look()
    assert day.happened == [event for part in EVENTS.values() for event in part]
