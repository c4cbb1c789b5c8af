"""The library of Foxglove's own web app as a client: NODE_PATH=/where/it/is pytest …"""

from __future__ import annotations

import asyncio
import json
import os
import shutil
from pathlib import Path

import pytest

from roboglot.model.components.sensing.odometry import Odometry
from tests.protocols.foxglove.conftest import ADDRESS, PORT, Scene

NODE = shutil.which("node")
THERE = any((Path(folder) / "@foxglove/ws-protocol").is_dir() for folder in os.environ.get("NODE_PATH", "").split(":"))


@pytest.mark.skipif(NODE is None or not THERE, reason="needs node, and @foxglove/ws-protocol and ws in NODE_PATH")
async def test_foxgloves_own_client_sees_and_drives(scene: Scene) -> None:
    script = Path(__file__).with_name("vendors_client.cjs")
    process = await asyncio.create_subprocess_exec(
        str(NODE), str(script), f"ws://{ADDRESS}:{PORT}", stdout=asyncio.subprocess.PIPE
    )
    ended = asyncio.get_running_loop().create_task(process.communicate())
    while not ended.done():
        await scene.clock.advance(0.1)
        await asyncio.sleep(0.01)
    seen = json.loads(ended.result()[0])
    assert process.returncode == 0, seen
    assert {"/tf", "/a/pose", "/a/battery", "/a/body"} <= set(seen["topics"])
    assert seen["status"] == []
    assert scene.robot[Odometry].reading.pose.x > 0.1
