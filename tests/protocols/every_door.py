"""A client of each door of one robot in lockstep: five doors and the console, what they tell and what they command."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Awaitable, Callable
from datetime import datetime
from typing import Any, TypeVar

import httpx
import pytest

from roboglot.agents.console import ConsoleClient
from roboglot.model.components.energy.power import PowerMode
from roboglot.model.geometry import Pose
from tests.protocols.cyberdog.test_walks import STATUS
from tests.protocols.life import ADDRESS, Life
from tests.protocols.vda5050.conftest import Control
from tests.protocols.vda5050.orders import action, instant

SYSTEM, MOTIONS, SLAM = "/api/core/system/v1", "/api/core/motion/v1", "/api/core/slam/v1"
STILL = 0.01  # m/s and rad/s up to which it stands
INFO = dict.fromkeys(("is_bat_info", "is_volume", "is_stand"), True)
LATE = 0.3  # s that VDA 5050's newest state and pose may be old
START = 2.0  # s that it may take to connect
SETTLED = 0.6  # s in which a robot that brakes comes to rest
PATIENCE = 60.0  # real s
DEPTH = "depth camera lost"
LOST = 0.3  # m by which a robot that is sure of its place may be wrong
Answer = TypeVar("Answer")
Words = dict[str, Any]


class Doors:
    """A client of each door; their questions let no time pass."""

    def __init__(self, life: Life, control: Control, console: str) -> None:
        self.life, self.control, self._console = life, control, ConsoleClient(console)
        self._http = httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", timeout=PATIENCE, verify=False)
        fleet = life.runtime.fleet
        self.robot, self.world = fleet.robots["a"], fleet.world
        self.origin = self.world.truth.pose_of("a")  # of the map, in the world
        self._text: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def close(self) -> None:
        await self.hang_up()
        await self._http.aclose()
        await self.life.close()

    async def hang_up(self) -> None:
        """Close the text connection; the next question opens another."""
        if self._text is not None:
            self._text[1].close()
            self._text = None

    async def forward(self, seconds: float) -> None:
        """Let time pass, and fleet control hear what was sent until then."""
        await self.life.forward(seconds)
        async with asyncio.timeout(PATIENCE):
            while not self._has_heard():  # noqa: ASYNC110 - messages take real time
                await asyncio.sleep(0.002)
        await asyncio.sleep(0.004)

    def _has_heard(self) -> bool:
        """Return whether fleet control has the robot's newest pose, and the state that this refers to."""
        self.control.hear()
        newest, states = self.control.heard.get("visualization", [{}])[-1], self.control.heard.get("state")
        if not states or not newest:
            return self.robot.clock.time() < START
        at = datetime.fromisoformat(newest["timestamp"]).timestamp()
        late = self.robot.clock.epoch() - at
        return late < LATE and bool(states[-1]["headerId"] >= newest["referenceStateHeaderId"])

    async def until(self, true: Callable[[], object]) -> None:
        """Let up to 60 s pass until the condition holds."""
        for _ in range(300):
            if true():
                return
            await self.forward(0.2)
        raise AssertionError(self.control.heard)

    async def _now(self, request: Awaitable[Answer]) -> Answer:
        """Wait for an answer that takes no robot time."""
        async with asyncio.timeout(PATIENCE):
            return await request

    async def rest(self, method: str, path: str, **content: Any) -> Any:
        reply = await self._now(self._http.request(method, path, **content))
        return reply.json() if reply.status_code == 200 and reply.content else reply.status_code

    async def set(self, name: str, value: str) -> Any:
        return await self.rest("PUT", f"{SYSTEM}/parameter", json={"param": name, "value": value})

    async def say(self, line: str) -> list[str]:
        """Ask in the text protocol."""
        if self._text is None:
            self._text = await asyncio.open_connection(ADDRESS, 40923)
            await self.say("command")
        self._text[1].write(f"{line};".encode())
        return (await self._now(self._text[0].readuntil(b";"))).decode().rstrip(";").split()

    async def dog(self, code: int, **params: Any) -> Words:
        answers = await self.life.during(self.life.phone.raw(code, params))  # a motion takes its time
        found: Words = json.loads(answers[-1][1])
        return found

    async def tell(self, kind: str, id: str, **parameters: str) -> str:
        """Have fleet control's instant action done; its status at the end."""
        self.control.send("instantActions", instant(action(kind, id, **parameters)))

        def status() -> str:
            states = self.control.state["instantActionStates"]
            return next((str(each["actionStatus"]) for each in states if each["actionId"] == id), "")

        await self.until(lambda: status() in ("FINISHED", "FAILED"))
        return status()

    async def console(self, verb: str = "", **values: object) -> Words:
        if verb:
            return await self._now(self._console.post(dict, "robots", "a", verb, values=values))
        return await self._now(self._console.get(dict, "robots", "a"))

    async def console_program(self) -> Words:
        return await self._now(self._console.get(dict, "robots", "a", "program"))

    # -- what they say -------------------------------------------------------------------------------------------------

    async def agree(self, **expected: object) -> None:
        """Assert that all doors say the same of the robot, which ``expected`` says, too."""
        await self.forward(SETTLED)
        fleet, page = self.control.state, await self.console()
        power, health = (
            await self.rest("GET", f"{SYSTEM}/power/status"),
            await self.rest("GET", f"{SYSTEM}/robot/health"),
        )
        status = json.loads((await self._now(self.life.phone.raw(STATUS)))[0][1])
        info = json.loads((await self._now(self.life.phone.raw(1001, INFO)))[0][1])
        moved, paused = await self._current()
        said: dict[str, tuple[object, ...]] = {
            "charge": (
                power["batteryPercentage"],
                int((await self.say("robot battery ?"))[0]),
                info["bat_info"]["power"],
                round(fleet["powerSupply"]["stateOfCharge"]),
                round(page["battery"]["charge"] * 100),
            ),
            "charging": (
                power["isCharging"],
                any(status["charging_status"].values()),
                info["bat_info"]["is_charging"],
                fleet["powerSupply"]["charging"],
                page["battery"]["charging"],
            ),
            "docked": (power["dockingStatus"] == "on_dock", page["safety"]["docked"]),
            "stopped": (
                health["hasSystemEmergencyStop"],
                fleet["safetyState"]["activeEmergencyStop"] != "NONE",
                page["safety"]["emergency_stop"] or page["body"]["posture"] == "limp",
            ),
            "faults": (
                sorted(fault["name"] for fault in page["faults"]),
                sorted(error["errorReferences"][0]["referenceValue"] for error in _faults(fleet)),
            ),
            "asleep": (
                power["sleepMode"] == "asleep",
                status["state_switch_status"]["state"] == 2,
                page["safety"]["power"] in (PowerMode.ASLEEP, PowerMode.LOW_POWER),
            ),
            "standing": (info["stand"], page["body"]["posture"] == "standing"),
            "paused": (
                fleet["paused"] and moved,  # fleet control's pause outlasts an order that others end
                paused,
                any(each["status"] == "PAUSED" for each in page["actions"]),
            ),
            "moved": (moved, bool(page["control"]["holder"])),
            "lost": (not fleet["mobileRobotPosition"]["localized"], bool(page["place"]["lost"])),
            "broken": (health["hasError"] or health["hasFatal"], _fails(page)),
            "others": (fleet["operatingMode"] == "MANUAL", _is_others(page["control"])),
            "speed limit": (
                float(await self.rest("GET", f"{SYSTEM}/parameter", params={"param": "base.max_moving_speed"})),
                self.control.heard["factsheet"][-1]["physicalParameters"]["maximumSpeed"],
                page["about"]["speed"],
            ),
            "sees depth": (
                not health["hasDepthCameraDisconnected"],
                not any(error["errorReferences"][0]["referenceValue"] == DEPTH for error in _faults(fleet)),
                all(fault["name"] != DEPTH for fault in page["faults"]),
            ),
            "maps": (
                sorted(each["mapId"] for each in fleet["maps"] if each["mapStatus"] == "DISABLED"),
                sorted((await self.console("maps"))["result"]),
                await self._maps_of_programs(),
            ),
            "floor": reported_floors(fleet, page),
            "volume": (info["volume"], round(page["body"]["volume"] * 100)),
        }
        for what, words in said.items():
            assert all(word == words[0] for word in words), (what, words)
        assert {what: said[what][0] for what in expected} == expected
        await self._agree_about_motion(fleet, page, lost=bool(said["lost"][0]))

    async def _maps_of_programs(self) -> list[str]:
        """Return the names that block programs get, and check the newest map of the dog's app against them."""
        inquiry = {"operate": "inquiry", "type": "SLAM", "mode": "map", "target_id": []}
        frames = await self._now(self.life.visual_now(inquiry))
        names = [each["id"] for each in frames[0]["list"]]
        newest = json.loads((await self._now(self.life.phone.raw(6003)))[0][1])
        assert (newest["mapName"] in names) if names else newest["mapName"] == ""
        return sorted(names)

    async def _current(self) -> tuple[bool, bool]:
        """Return whether an action is under way by Slamware, and whether it is paused."""
        current = await self.rest("GET", f"{MOTIONS}/actions/:current")
        return current != 404, current != 404 and current["state"]["status"] == 3

    async def _agree_about_motion(self, fleet: Words, page: Words, *, lost: bool) -> None:
        seen, pose = self.control.heard["visualization"][-1], await self.rest("GET", f"{SLAM}/localization/pose")
        place, velocity = seen["mobileRobotPosition"], seen["velocity"]
        speed = await self.rest("GET", f"{MOTIONS}/speed")
        x, y, turning = (float(word) for word in (await self.say("chassis speed ?"))[:3])
        twist = [speed[key] for key in ("vx", "vy", "omega")]
        moves, here = max(map(abs, twist)) > STILL, Pose(pose["x"], pose["y"], pose["yaw"])
        assert [x, -y, -math.radians(turning)] == pytest.approx(twist, abs=0.002)
        assert page["velocity"] == pytest.approx(twist, abs=0.3 if moves else STILL)
        assert fleet["driving"] is moves
        assert (max(map(abs, velocity.values())) > STILL) is moves
        assert Pose(*page["pose"]).distance_to(here) < 0.02
        assert Pose(place["x"], place["y"], place["theta"]).distance_to(here) < (LATE * 1.5 if moves else 0.05)
        if not lost:
            assert self.origin.compose(here).distance_to(self.world.truth.pose_of("a")) < LOST


def reported_floors(fleet: Words, page: Words) -> tuple[int, ...]:
    """Return the floor of the console, and those that fleet control's ids of maps name."""
    in_use = next(each["mapId"] for each in fleet["maps"] if each["mapStatus"] == "ENABLED")
    ids = fleet["mobileRobotPosition"]["mapId"], in_use
    return page["place"]["floor"] or 0, *(int(id.removeprefix("map").removeprefix("-") or 0) for id in ids)


def _faults(fleet: Words) -> list[Words]:
    return [error for error in fleet["errors"] if error["errorType"] == "ROBOT_FAULT"]


def _fails(page: Words) -> bool:
    """Return whether Slamware has an error: one warning of others has an error's number there, known from robots."""
    numbered = {"not localized"}
    serious = any(fault["level"] != "WARNING" or fault["name"] in numbered for fault in page["faults"])
    return serious or page["body"]["posture"] == "limp"


def _is_others(control: Words) -> bool:
    """Return whether others than fleet control move the robot, or may alone."""
    taken, holder = control["taken_by"], control["holder"]
    return bool(taken or holder) and not (taken or holder).startswith("vda5050")
