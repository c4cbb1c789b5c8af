"""Doors while kernels compile: each says in its own words that navigation is not ready, and drives by hand."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path

import grpc
import httpx
import pytest

from roboglot.autonomy.navigation.navigation import GridNavigation
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.errors import NotReady
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service
from tests.protocols.test_capabilities import meanwhile

pytestmark = pytest.mark.world("empty")
ACTIONS = "/api/core/motion/v1/actions"
MOVE_TO = {
    "action_name": "slamtec.agent.actions.MoveToAction",
    "options": {"target": {"x": 1, "y": 0, "z": 0}, "move_options": {"mode": 0}},
}
MOVE_BY = {"action_name": "slamtec.agent.actions.MoveByAction", "options": {"direction": 0, "duration": 200}}


@pytest.fixture
def warming_up(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    navigation = robot[Navigation]
    assert isinstance(navigation, GridNavigation)
    context = navigation._context
    monkeypatch.setattr(context, "planner", None)
    monkeypatch.setattr(context, "unavailable", NotReady("navigation is warming up: its kernels are being compiled"))


@pytest.fixture
async def rest(robot: Robot) -> AsyncIterator[httpx.AsyncClient]:
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    async with httpx.AsyncClient(base_url=door.endpoints[0].address, verify=False) as client:
        yield client
    await door.close()


@pytest.mark.usefixtures("warming_up")
async def test_rest_creates_no_action_and_says_why(rest: httpx.AsyncClient, forward: Forward) -> None:
    refused = await meanwhile(rest.post(ACTIONS, json=MOVE_TO), forward)
    assert refused.status_code == 400
    assert "warming up" in refused.text
    driven = await meanwhile(rest.post(ACTIONS, json=MOVE_BY), forward)
    assert driven.status_code == 200


@pytest.mark.usefixtures("warming_up")
async def test_a_dogs_task_fails_with_a_feedback(robot: Robot, forward: Forward, tmp_path: Path) -> None:
    door = CyberDogDoor(robot, "127.0.0.1", CyberDogConfig(port=0, app_port=1, plaintext=True), tmp_path)
    await door.start()
    await forward(seconds=1.0)  # the robot has a map, however early the first request
    async with grpc.aio.insecure_channel(f"127.0.0.1:{door.port}") as channel:
        send = service.GrpcAppStub(channel).sendMsg

        async def ask(code: int, **params: object) -> list[dict[str, object]]:
            request = pb.SendRequest(nameCode=code, params=json.dumps(params))
            return [json.loads(answer.data) async for answer in send(request)]

        assert {"result": 0} in await meanwhile(ask(6004, type=7, outdoor=False), forward)
        answers = await meanwhile(ask(6004, type=1, goalX=1.0, goalY=0.0, theta=0.0), forward)
        assert answers[-2]["feedback_code"] == 304
        assert "warming up" in str(answers[-2]["feedback_msg"])
        assert answers[-1] == {"result": 3}
    await door.close()
