"""One robot behind five open doors and the console.

In each state all of them tell the same, and what the world has; of two commands at once, none succeeds falsely.
"""

from __future__ import annotations

import asyncio
import itertools

import pytest

from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.system.lease import Lease
from roboglot.model.events import ActionChanged
from roboglot.model.geometry import Pose
from tests.protocols.commands import COMMANDS, move_by_text
from tests.protocols.cyberdog.test_walks import MOTION, STOP
from tests.protocols.every_door import MOTIONS, PATIENCE, SYSTEM, Doors
from tests.protocols.vda5050.orders import order


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


@pytest.mark.world("office")
async def test_doors_tell_one_floor_map_and_limit(doors: Doors) -> None:
    await doors.forward(2)
    await doors.agree(floor=0, maps=[], faults=[], **{"sees depth": True})
    doors.world.faults.inject("depth_camera_gone", "a")
    await doors.forward(3)
    await doors.agree(broken=True, faults=["depth camera lost"], **{"sees depth": False})
    doors.world.faults.clear()
    assert await doors.set("base.max_moving_speed", "0.4") is True
    await doors.console("save_map", map="hall")
    doors.robot[Floors].begin_on(1)
    await doors.forward(3)  # fleet control's list of maps is two seconds old at most
    await doors.agree(floor=1, maps=["hall"], broken=False, **{"speed limit": 0.4, "sees depth": True})
    doors.robot[Floors].begin_on(0)
    assert await doors.tell("deleteMap", "d", mapId="hall", mapVersion="") == "FINISHED"
    await doors.agree(floor=0, maps=[])


async def _take_control(doors: Doors) -> bool:
    await doors.robot[Lease].take("robomaster")
    return False


@pytest.mark.slow  # in short: test_all_doors_tell_the_same
@pytest.mark.timeout(600)
async def test_no_command_succeeds_falsely_beside_another(doors: Doors) -> None:
    ended, start = list[ActionChanged](), doors.world.truth.pose_of("a")
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
        doors.world.stage.place("a", start)  # else it reaches a wall in the end
        await doors.forward(2)
        succeeded = {event.action.id for event in ended if event.action.status.name == "SUCCEEDED"}
        assert sum(both.result()) <= len(succeeded), pair
        if _take_control not in pair:
            assert any(both.result()), pair
        elif move_by_text not in pair:  # who has control moves the robot, and no one else does
            assert not succeeded, pair
