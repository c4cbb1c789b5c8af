"""A slow network: frames come as late as the fault says, in robot time."""

import json

from roboglot.model.components.system.network import Network


async def test_frames_come_late(connect, robot, clock) -> None:
    app = await connect(robot)
    robot[Network].delay = 3.0
    await app.door.receive(json.dumps({"type": "module", "id": "f", "operate": "inquiry", "target_id": []}))
    await clock.advance(2.9)
    assert app.frames == []
    await clock.advance(0.2)
    assert [frame["response"]["id"] for frame in app.frames] == ["f"]


async def test_recovered_network_keeps_frames_in_order(connect, robot, clock) -> None:
    app = await connect(robot)
    for id, delay in (("first", 3.0), ("second", 0.0), ("third", 1.0)):
        robot[Network].delay = delay
        await app.door.receive(json.dumps({"type": "module", "id": id, "operate": "inquiry", "target_id": []}))
    await clock.advance(3.1)
    assert [frame["response"]["id"] for frame in app.frames] == ["first", "second", "third"]
