"""One command of each door that moves the robot: whether it was done, by the door's own words."""

from __future__ import annotations

import asyncio
import json

from roboglot.agents.console import Refused
from tests.protocols.cyberdog.test_walks import MOTION
from tests.protocols.every_door import MOTIONS, Doors
from tests.protocols.vda5050.orders import action, instant


async def turn_by_rest(doors: Doors) -> bool:
    turn = {"action_name": "slamtec.agent.actions.RotateAction", "options": {"angle": 1.0}}
    begun = await doors.rest("POST", f"{MOTIONS}/actions", json=turn)
    if not isinstance(begun, dict):
        return False
    url = f"{MOTIONS}/actions/{begun['action_id']}"
    while (state := (await doors.rest("GET", url))["state"])["status"] != 4:  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    return bool(state["result"] == 0)


async def move_by_text(doors: Doors) -> bool:
    return await doors.say("chassis move x 0.2 wait_for_complete true") == ["ok"]


async def walk_by_dog(doors: Doors) -> bool:
    walk = {"motion_id": 303, "vel_des": [0.2, 0, 0], "duration": 1000}
    return json.loads((await doors.life.phone.raw(MOTION, walk))[-1][1]).get("result") is True


async def undock_by_fleet(doors: Doors) -> bool:
    """A robot that is not online loses messages, or drops them."""
    id = f"undock {doors.robot.clock.time()}"
    doors.control.send("instantActions", instant(action("stopCharging", id)), wait=False)
    while doors.control.heard["connection"][-1]["connectionState"] == "ONLINE":
        states = doors.control.state["instantActionStates"]
        status = next((each["actionStatus"] for each in states if each["actionId"] == id), "")
        if status in ("FINISHED", "FAILED"):
            return bool(status == "FINISHED")
        await asyncio.sleep(0.01)
        doors.control.hear()
    return False


async def drive_by_console(doors: Doors) -> bool:
    try:
        id = (await doors.console("drive", yaw=0.5, seconds=1.0))["result"]["action"]
    except Refused:
        return False
    while not (ended := [each for each in (await doors.console())["history"] if each["id"] == id]):  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    return bool(ended[0]["status"] == "SUCCEEDED")


async def turn_by_program(doors: Doors) -> bool:
    source = "answer = cyberdog.motion.turn(20)\nprint(answer.state.code, answer.response.result)\n"
    await doors.console("program", source=source)
    while (run := await doors.console_program())["state"] in ("run", "run_wait"):  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    return bool([line["text"] for line in run["log"]][-1:] == ["0 True"])


COMMANDS = (turn_by_rest, move_by_text, walk_by_dog, undock_by_fleet, drive_by_console, turn_by_program)
