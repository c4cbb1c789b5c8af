"""App on a delivery robot's screen: creates tasks, watches the stage, operates boxes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import httpx

from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.geometry import Pose
from roboglot.simulation.world.world import World
from roboglot.testing import Forward

API, POIS = "/api/delivery/v1", "/api/core/artifact/v1/pois"
TASKS = f"{API}/tasks"


class Screen:
    """One client at a robot that woke up at the origin of its map."""

    def __init__(self, client: httpx.AsyncClient, forward: Forward, world: World) -> None:
        self.client, self.forward = client, forward
        self.origin = world.truth.pose_of("a")
        self._world, self._robot = world, world.robot("a")
        self.cargo = ""
        self.boxes: list[int] = []

    async def prepare(self, **places: tuple[float, float, str]) -> None:
        """Put places on the map and learn the cargo's name."""
        await self.forward(seconds=1)
        for number, (name, (x, y, kind)) in enumerate(places.items()):
            metadata = {"display_name": name, "type": kind}
            body = {"id": f"poi-{number}", "pose": {"x": x, "y": y, "yaw": 0.0}, "metadata": metadata}
            assert (await self.client.post(POIS, json=body)).status_code == 200
        cargo = (await self.client.get(f"{API}/cargos")).json()[0]
        self.cargo, self.boxes = cargo["id"], [box["id"] for box in cargo["boxes"]]

    async def wait_for_pickups(self, *, seconds: float) -> None:
        """Have the robot wait so long instead of the usual 300 s."""
        delivery = self._robot[Delivery]
        await delivery.change_policy(lambda policy: replace(policy, pickup_seconds=seconds))

    @property
    def pose(self) -> Pose:
        """True pose of the robot, in the map."""
        return self._world.truth.pose_of("a").relative_to(self.origin)

    def request(self, target: str, kind: str = "TAKEOUT", *boxes: int, stops: list[str] | None = None) -> Any:
        cargos = [{"cargo_id": self.cargo, "boxes": [f"{box:03}" for box in boxes]}] if boxes else []
        return {"location": {"poi_name": target, "task_points": stops or []}, "type": kind, "cargos": cargos}

    async def create(self, target: str, kind: str = "TAKEOUT", *boxes: int, stops: list[str] | None = None) -> str:
        reply = (await self.client.post(TASKS, json=self.request(target, kind, *boxes, stops=stops))).json()
        assert reply["result"], reply
        return str(reply["order_id"])

    async def stage(self) -> Any:
        return (await self.client.get(f"{API}/stage")).json()

    async def until(self, stage: str, *, within: float = 60.0) -> Any:
        """Poll once a second, as clients do; the stage."""
        seen = []
        for _ in range(int(within)):
            seen.append(await self.stage())
            if seen[-1]["stage"] == stage:
                return seen[-1]
            await self.forward(seconds=1)
        raise AssertionError(f"no {stage} within {within} s: {[s['stage'] for s in seen[-5:]]} {seen[-1]}")

    async def task(self, number: str) -> Any:
        tasks = (await self.client.get(TASKS, params={"status": "all"})).json()
        return next(task for task in tasks if task["task"]["order_id"] == number)

    async def say(self, what: str) -> int:
        return (await self.client.put(f"{TASKS}/:{what}")).status_code

    async def box(self, number: int) -> Any:
        return (await self.client.get(f"{API}/cargos/{self.cargo}/boxes/{number}")).json()

    async def operate(self, number: int, operation: str) -> None:
        path = f"{API}/cargos/{self.cargo}/boxes/{number}"
        assert (await self.client.put(f"{path}/{operation}")).status_code == 200

    async def events(self) -> list[str]:
        return [event["type"] for event in (await self.client.get("/api/platform/v1/events")).json()]
