"""The capability page says what the doors answer: every row is asked on every simulated body.

The text door's are asked in ``robomaster/test_capabilities.py``.
"""

from __future__ import annotations

import asyncio
import itertools
import json
from collections import defaultdict
from collections.abc import Awaitable
from pathlib import Path
from typing import TypeVar

import grpc
import httpx
import pytest

from roboglot.cli.capabilities import BODIES, RobotKind
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.cyberdog.table import TABLE as CODES
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.protocols.slamware.table import TABLE
from roboglot.testing import Forward
from roboglot.wire.cyberdog.codes import SILENT_WITHOUT_SERVICE
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service
from tests.protocols.cyberdog.phone import examples
from tests.protocols.slamware.generated import SILENCING, Generator

T = TypeVar("T")
ASKED = 340  # requests generated from the OpenAPI document: two of each operation
PATIENCE = 1300  # times 0.1 s of the robot: a localization gives up after 120 s, and what was asked before may spoil it
REBOOT = {9031}  # switches the robot off
OFF = SILENCING | {"POST /api/core/system/v1/power/:hibernate"}
REFUSED, NOT_IMPLEMENTED = 400, 501
# Requests that check themselves whether a part of a component is there: the page lists them as served, with a note.
ASK_THEMSELVES = {
    "GET /api/core/system/v1/parameter",  # a dock, for one of its parameters
    "PUT /api/core/system/v1/parameter",  # an emergency stop, for two of them
    "GET /api/core/system/v1/network/apn",  # a modem
    "PUT /api/core/system/v1/network/apn",
    "PUT /api/core/system/v1/network/route",
    "POST /api/core/system/v1/light/control",  # lamps of that name
    "POST /api/core/artifact/v1/pois",  # the robot's own place, if the target has no pose
    "POST /api/multi-floor/map/v1/search_path_points",  # the same, if it has no start
    "1004",  # 213: feet
    "1013",  # a microphone
    "1014",
    "1015",  # eyes
    "3011",
    "6009",  # 0 stops everything
}

every_body = pytest.mark.parametrize(
    "body",
    [  # the two bodies that share least; the others are slow
        pytest.param(
            body,
            marks=[
                pytest.mark.world("office", body=body),
                *([] if body in ("cyberdog2", "robomaster_ep") else [pytest.mark.slow]),
            ],
        )
        for body in BODIES
    ],
)


async def meanwhile(asking: Awaitable[T], forward: Forward) -> T:
    """Robot time passes until there is an answer."""
    asked = asyncio.ensure_future(asking)
    for _ in range(PATIENCE):
        await asyncio.wait([asked], timeout=0.001)
        if asked.done():
            break
        await forward(seconds=0.1)
    return await asyncio.wait_for(asked, 60.0)


@pytest.mark.slow
@every_body
async def test_the_doors_refuse_what_the_page_says(body: str, robot: Robot, forward: Forward, tmp_path: Path) -> None:
    kind = RobotKind(body, frozenset(robot.interfaces), {})
    wrong = await rest(kind, robot, forward) | await dog(kind, robot, forward, tmp_path)
    assert {row: answers for row, answers in wrong.items() if row not in ASK_THEMSELVES} == {}


@pytest.mark.slow  # one order: test_the_doors_refuse_what_the_page_says
@pytest.mark.world("office", body="robomaster_ep")
@pytest.mark.parametrize("seed", [2, 4])
async def test_no_order_of_requests_opens_what_is_refused(seed: int, robot: Robot, forward: Forward) -> None:
    wrong = await rest(RobotKind("robomaster_ep", frozenset(robot.interfaces), {}), robot, forward, seed, 3 * ASKED)
    assert {row: answers for row, answers in wrong.items() if row not in ASK_THEMSELVES} == {}


async def rest(
    kind: RobotKind, robot: Robot, forward: Forward, seed: int = 1, requests: int = ASKED
) -> dict[str, object]:
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    seen = defaultdict[str, set[int]](set)
    async with httpx.AsyncClient(base_url=door.endpoints[0].address, verify=False) as client:
        generator = Generator((await client.get("/openapi.json")).json(), seed, frozenset(OFF))
        for request in itertools.islice(generator.requests(), requests):
            if not request.wrong:
                asked = client.request(
                    request.method, request.url, params=request.params, headers=request.headers, content=request.content
                )
                reply = await meanwhile(asked, forward)
                generator.problem(request, reply)  # needs learned names
                seen[request.key].add(reply.status_code)
    await door.close()
    # Refused requests may have another fault before the part is asked for: never a success.
    return {
        operation.key: statuses
        for operation in TABLE
        if (statuses := seen[operation.key])
        and (min(statuses) < REFUSED if kind.judge(operation.needs) == "refused" else NOT_IMPLEMENTED in statuses)
    }


async def dog(kind: RobotKind, robot: Robot, forward: Forward, data: Path) -> dict[str, object]:
    door = CyberDogDoor(robot, "127.0.0.1", CyberDogConfig(port=0, app_port=1, plaintext=True), data)
    await door.start()
    wrong: dict[str, object] = {}
    async with grpc.aio.insecure_channel(f"127.0.0.1:{door.port}") as channel:
        send = service.GrpcAppStub(channel).sendMsg

        async def ask(code: int, params: str) -> list[str]:
            return [answer.data async for answer in send(pb.SendRequest(nameCode=code, params=params))]

        for code, params, _ in examples("cyberdog.md"):
            operation = CODES.get(code)
            if operation is None or code in REBOOT:
                continue
            answers = await meanwhile(ask(code, params), forward)
            lacks = kind.judge(operation.needs) == "refused"
            if unavailable(code, answers) != lacks:
                wrong[str(code)] = (answers, sorted(n.__name__ for n in operation.needs - kind.components))
    await door.close()
    return wrong


def unavailable(code: int, answers: list[str]) -> bool:
    """Return whether the answer is that of a robot without the part."""
    if code in SILENT_WITHOUT_SERVICE:
        return not answers
    reported = [json.loads(answer) for answer in answers if answer]
    return any(each.get("error_code") == 322 or each.get("code") == 3008 for each in reported)
