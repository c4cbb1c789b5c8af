"""One robot behind five open doors and the console.

In each state all of them tell the same, and what the world has; of two commands at once, none succeeds falsely.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import math
import subprocess
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

import httpx
import pytest

from roboglot.agents.console import ConsoleClient, Refused
from roboglot.model.components.energy.power import PowerMode
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.system.lease import Lease
from roboglot.model.events import ActionChanged
from roboglot.model.geometry import Pose
from roboglot.testing.addresses import free_port
from tests.protocols.cyberdog.phone import Messages
from tests.protocols.cyberdog.test_walks import MOTION, STATUS, STOP
from tests.protocols.life import ADDRESS, Life
from tests.protocols.lockstep import lockstep_runtime
from tests.protocols.vda5050.conftest import ADDRESS as BROKER
from tests.protocols.vda5050.conftest import MOSQUITTO, Control, listening
from tests.protocols.vda5050.orders import action, instant, order

SYSTEM, MOTIONS, SLAM = "/api/core/system/v1", "/api/core/motion/v1", "/api/core/slam/v1"
STILL = 0.01  # m/s and rad/s up to which it stands
INFO = dict.fromkeys(("is_bat_info", "is_volume", "is_stand"), True)
LATE = 0.3  # s that VDA 5050's newest state and pose may be old
START = 2.0  # s that it may take to connect
SETTLED = 0.6  # s in which a robot that brakes comes to rest
PATIENCE = 60.0  # real s
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
        if self._text is not None:
            self._text[1].close()
        await self._http.aclose()
        await self.life.close()

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

    async def tell(self, kind: str, id: str) -> str:
        """Have fleet control's instant action done; its status at the end."""
        self.control.send("instantActions", instant(action(kind, id)))

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
            "volume": (info["volume"], round(page["body"]["volume"] * 100)),
        }
        for what, words in said.items():
            assert all(word == words[0] for word in words), (what, words)
        assert {what: said[what][0] for what in expected} == expected
        await self._agree_about_motion(fleet, page, lost=bool(said["lost"][0]))

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


@pytest.fixture
def control(tmp_path: Path) -> Iterator[tuple[int, Control]]:
    """A broker of our own: its port, and a fleet control there."""
    if MOSQUITTO is None:
        pytest.skip("needs mosquitto: apt-get install mosquitto")
    port, file = free_port(), tmp_path / "conf"
    file.write_text(f"listener {port} {BROKER}\nallow_anonymous true\n")
    broker = subprocess.Popen([MOSQUITTO, "-c", str(file)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    listening(port)
    control = Control(port, "v3")
    yield port, control
    control.close()
    broker.terminate()
    broker.wait()


@pytest.fixture
async def doors(tmp_path: Path, control: tuple[int, Control], monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Doors]:
    """A robot in lockstep with a client at every door."""
    monkeypatch.setattr("roboglot.agents.console.SECONDS", PATIENCE)
    port, fleet = control
    door = {"broker": f"{BROKER}:{port}", "serials": {"a": "a"}, "visualization_period": 0.2}
    names = "slamware", "robomaster", "cyberdog", "visual", "vda5050"
    robots = [{"name": "a", "body": "universal", "address": ADDRESS}]
    console = {"enabled": True, "port": 0}
    runtime = await lockstep_runtime(tmp_path / "data", ADDRESS, *names, robots=robots, vda5050=door, console=console)
    assert runtime.console is not None
    await runtime.console.ready()
    made = Doors(Life(runtime, tmp_path / "data", Messages(tmp_path)), fleet, runtime.console.address)
    await made.until(lambda: fleet.heard.get("visualization"))
    yield made
    await made.close()


async def test_all_doors_tell_the_same(doors: Doors) -> None:
    faults = doors.world.faults
    await doors.agree(charge=90, charging=True, docked=True, stopped=False, faults=[], moved=False, others=False)
    goal = {"action_name": "slamtec.agent.actions.MoveToAction", "options": {"target": {"x": 4, "y": 2}}}
    await doors.rest("POST", f"{MOTIONS}/actions", json=goal)
    await doors.forward(1.5)
    await doors.agree(charging=False, docked=False, moved=True, others=True, paused=False)
    assert await doors.set("base.emergency_stop", "on") is True
    await doors.forward(2)  # its wheels slipped: until then it finds its place again
    await doors.agree(stopped=True, broken=True, moved=False, others=False, standing=True)
    assert await doors.set("base.emergency_stop", "off") is True
    assert (await doors.dog(MOTION, motion_id=STOP))["result"] is True
    await doors.agree(stopped=True, broken=True, standing=False, moved=False)
    assert await doors.say("chassis move x 0.1") == ["fail"]
    assert (await doors.dog(MOTION, motion_id=111))["result"] is True
    await doors.agree(stopped=False, broken=False, standing=True)
    here = doors.robot[Localization].pose
    doors.control.send("order", order("o", [(here.x, here.y), (0, 0)]))
    await doors.forward(1.5)
    await doors.agree(moved=True, others=False, paused=False)
    assert await doors.tell("startPause", "p") == "FINISHED"
    await doors.forward(2)
    await doors.agree(moved=True, others=False, paused=True)
    await doors.console("take_control")
    await doors.agree(moved=False, others=True)
    assert await doors.say("chassis move x 0.1") == ["fail"]
    await doors.console("release_control")
    faults.inject("low_battery", "a", charge=0.12)
    await doors.forward(1)
    await doors.agree(charge=12, charging=False, broken=False, faults=["battery low"])
    faults.clear()
    faults.inject("lidar_gone", "a")
    await doors.forward(5)
    await doors.agree(broken=True, lost=True, faults=["lidar lost", "not localized"])
    faults.clear()
    await doors.forward(2)
    doors.world.stage.place("a", Pose(8, 8, 2))
    await doors.forward(3)
    await doors.agree(lost=True, moved=False)
    assert await doors.rest("POST", f"{SYSTEM}/power/:hibernate") == 200
    await doors.forward(6)
    await doors.agree(asleep=True, standing=False, moved=False)


# -- two commands at once: whether each was done, by its own door's words ---------------------------------------------


async def _turn_by_rest(doors: Doors) -> bool:
    turn = {"action_name": "slamtec.agent.actions.RotateAction", "options": {"angle": 1.0}}
    begun = await doors.rest("POST", f"{MOTIONS}/actions", json=turn)
    if not isinstance(begun, dict):
        return False
    url = f"{MOTIONS}/actions/{begun['action_id']}"
    while (state := (await doors.rest("GET", url))["state"])["status"] != 4:  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    return bool(state["result"] == 0)


async def _move_by_text(doors: Doors) -> bool:
    return await doors.say("chassis move x 0.2 wait_for_complete true") == ["ok"]


async def _walk_by_dog(doors: Doors) -> bool:
    walk = {"motion_id": 303, "vel_des": [0.2, 0, 0], "duration": 1000}
    return json.loads((await doors.life.phone.raw(MOTION, walk))[-1][1])["result"] is True


async def _undock_by_fleet(doors: Doors) -> bool:
    id = f"undock {doors.robot.clock.time()}"
    doors.control.send("instantActions", instant(action("stopCharging", id)), wait=False)
    while True:
        doors.control.hear()
        states = doors.control.state["instantActionStates"]
        status = next((each["actionStatus"] for each in states if each["actionId"] == id), "")
        if status in ("FINISHED", "FAILED"):
            return bool(status == "FINISHED")
        await asyncio.sleep(0.01)


async def _drive_by_console(doors: Doors) -> bool:
    try:
        id = (await doors.console("drive", yaw=0.5, seconds=1.0))["result"]["action"]
    except Refused:
        return False
    while not (ended := [each for each in (await doors.console())["history"] if each["id"] == id]):  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    return bool(ended[0]["status"] == "SUCCEEDED")


async def _turn_by_program(doors: Doors) -> bool:
    source = "answer = cyberdog.motion.turn(20)\nprint(answer.state.code, answer.response.result)\n"
    await doors.console("program", source=source)
    while (run := await doors.console_program())["state"] in ("run", "run_wait"):  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    return bool([line["text"] for line in run["log"]][-1:] == ["0 True"])


async def _take_control(doors: Doors) -> bool:
    await doors.robot[Lease].take("robomaster")
    return False


COMMANDS = (_turn_by_rest, _move_by_text, _walk_by_dog, _undock_by_fleet, _drive_by_console, _turn_by_program)


@pytest.mark.slow  # in short: test_all_doors_tell_the_same
@pytest.mark.timeout(600)
async def test_no_command_succeeds_falsely_beside_another(doors: Doors) -> None:
    ended = list[ActionChanged]()
    doors.robot.events.listen(ActionChanged, ended.append)
    await doors.say("robot battery ?")
    for pair in itertools.permutations((*COMMANDS, _take_control), 2):
        ended.clear()
        both = asyncio.gather(*(command(doors) for command in pair))
        async with asyncio.timeout(PATIENCE):
            while not both.done():
                await asyncio.sleep(0.01)
                await doors.life.forward(0.1)
        await doors.robot[Lease].release()
        await doors.forward(2)
        succeeded = {event.action.id for event in ended if event.action.status.name == "SUCCEEDED"}
        assert sum(both.result()) <= len(succeeded), pair
        if _take_control not in pair:
            assert any(both.result()), pair
        elif _move_by_text not in pair:  # who has control moves the robot, and no one else does
            assert not succeeded, pair
