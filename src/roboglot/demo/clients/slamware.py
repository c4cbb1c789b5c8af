"""A plain HTTP client of the Slamware REST API."""

from __future__ import annotations

import asyncio
from typing import Any

import httpx

MOTION = "/api/core/motion/v1"
SLAM = "/api/core/slam/v1"
DONE = 4
MAP_HEADER = 36  # bytes before the cells
PATIENCE = 300.0  # s per request and move: the machine may be busy


class SlamwareClient:
    """Asks and moves the robot at ``address`` over REST."""

    def __init__(self, address: str, port: int = 1448) -> None:
        self._http = httpx.AsyncClient(base_url=f"http://{address}:{port}", timeout=PATIENCE)

    async def close(self) -> None:
        """Hang up."""
        await self._http.aclose()

    async def get(self, path: str) -> Any:
        """Return the JSON at ``path``."""
        return (await self._http.get(path)).raise_for_status().json()

    async def pose(self) -> tuple[float, float, float]:
        """x, y in m and yaw in rad, in the map."""
        pose = await self.get(f"{SLAM}/localization/pose")
        return pose["x"], pose["y"], pose["yaw"]

    async def scan(self) -> list[tuple[float, float]]:
        """Valid (angle rad from ahead, distance m) of the last laser scan."""
        scan = await self.get("/api/core/system/v1/laserscan")
        return [(p["angle"], p["distance"]) for p in scan["laser_points"] if p["valid"]]

    async def wait_for_map(self) -> None:
        """Return when the robot has begun its map: in the first second after its start it has none."""
        async with asyncio.timeout(PATIENCE):
            while len(await self.map()) <= MAP_HEADER:  # noqa: ASYNC110 - only polling
                await asyncio.sleep(0.2)

    async def map(self) -> bytes:
        """Return the explored map as the robot sends it."""
        return (await self._http.get(f"{SLAM}/maps/explore")).raise_for_status().content

    async def move_to(self, x: float, y: float, yaw: float) -> None:
        """Create a MoveTo and poll it until it has ended, as dashboards do."""
        action = {
            "action_name": "slamtec.agent.actions.MoveToAction",
            "options": {
                "target": {"x": x, "y": y, "z": 0},
                "move_options": {"mode": 0, "flags": ["with_yaw", "precise"], "yaw": yaw},
            },
        }
        created = (await self._http.post(f"{MOTION}/actions", json=action)).raise_for_status().json()
        async with asyncio.timeout(PATIENCE):
            while (state := await self._state_of(created["action_id"]))["status"] != DONE:  # noqa: ASYNC110 - only polling
                await asyncio.sleep(0.25)
        if state["result"] != 0:
            raise RuntimeError(f"MoveTo failed: {state['reason']}")

    async def _state_of(self, action: int) -> Any:
        return (await self.get(f"{MOTION}/actions/{action}"))["state"]
