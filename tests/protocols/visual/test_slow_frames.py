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
