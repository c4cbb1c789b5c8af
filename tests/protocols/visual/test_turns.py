"""Frames of a front end beyond its share wait for the other clients', but not those that end programs."""

from __future__ import annotations

import json

from roboglot.clients.visual import TextLink
from roboglot.model.robot import Robot
from tests.protocols.held_fairness import held, until
from tests.protocols.visual.test_websocket_door import address, door

__all__ = ["address", "door"]


def frame(number: int, operate: str) -> str:
    return json.dumps({"type": "task", "id": str(number), "target_id": ["t"], "operate": operate})


async def test_frames_wait_in_order_until_one_ends_programs(plain_robot: Robot, address: str) -> None:
    link, fairness = await TextLink.open(address, "/programs"), held(plain_robot)
    fairness.on = True
    for number in range(5):
        await link.send(frame(number, "inquiry"))
    await until(lambda: fairness.waited)
    await link.send(frame(5, "shutdown"))
    answers = [json.loads(await anext(link)) for _ in range(6)]
    ids = [(answer.get("feedback") or answer["response"])["id"] for answer in answers]
    assert ids == [str(number) for number in range(6)]
    waited = len(fairness.waited)
    await link.send(frame(6, "inquiry"))
    await until(lambda: len(fairness.waited) > waited + 3)
    fairness.on = False
    assert (json.loads(await anext(link))["response"])["id"] == "6"
    assert fairness.counted
    await link.close()


async def test_flood_of_frames_is_answered_whole(plain_robot: Robot, address: str) -> None:
    link, fairness = await TextLink.open(address, "/runs"), held(plain_robot)
    fairness.on = True
    for _ in range(200):
        await link.send("?")
    await until(lambda: len(fairness.waited) > 3)
    fairness.on = False
    for _ in range(200):
        assert json.loads(await anext(link)) == {"runs": []}
    await link.close()
