"""Doors answer as the capabilities page says: each request is sent to each kind of robot, drivers' ones included."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import AsyncIterator, Mapping
from pathlib import Path

import httpx
import pytest

from roboglot.cli.capabilities import BODIES, DRIVERS, RobotKind
from roboglot.model.errors import ComponentMissing
from roboglot.model.robot import Robot
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.robomaster.explain import completed
from roboglot.protocols.robomaster.shapes import shape_of
from roboglot.protocols.robomaster.table import TABLE as COMMANDS
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.protocols.slamware.table import TABLE as REQUESTS
from roboglot.recording.lines import REFUSALS
from roboglot.testing import Forward
from tests.drivers.clients import Drive, Open
from tests.drivers.rig import rig, time_passes
from tests.protocols.slamware import generated
from tests.protocols.slamware.generated import Generator

ROUNDS = 3  # requests of each operation
DONE = "2"
NOT_IMPLEMENTED = 501
SLEEPY = [operation.key for operation in REQUESTS if "/power/" in operation.key or "/firmware/" in operation.key]
ENDING = {"quit", "command"}
KINDS = [
    *(
        pytest.param("", body, marks=[pytest.mark.world("office", body=body), *slow])
        for body, slow in (
            ("robomaster_ep", []),
            *((body, [pytest.mark.slow]) for body in BODIES if body != "robomaster_ep"),
        )
    ),
    pytest.param("slamware", "hermes", marks=pytest.mark.world("office", body="hermes")),
    pytest.param(
        "robomaster", "robomaster_ep", marks=[pytest.mark.world("office", body="robomaster_ep"), pytest.mark.slow]
    ),
    pytest.param("cyberdog", "cyberdog2", marks=[pytest.mark.world("office", body="cyberdog2"), pytest.mark.slow]),
]


@pytest.fixture
async def kind(
    back: str, body: str, robot: Robot, drive: Drive, forward: Forward, tmp_path: Path
) -> AsyncIterator[tuple[Robot, RobotKind]]:
    """A robot, simulated or the driver's of one behind its vendor's door, and what the page says of its kind."""
    if not back:
        await forward(seconds=1)
        async with time_passes(forward):
            yield robot, RobotKind(body, frozenset(robot.interfaces), {})
        return
    async with rig(back, robot, tmp_path) as there, time_passes(forward, threads=back == "cyberdog"):
        driven = await drive(there.url)
        announced = DRIVERS[f"{back}://"][1]
        yield driven, RobotKind(back, frozenset(driven.interfaces) | announced.keys(), announced)


def untruths(
    kind: RobotKind, asked: Mapping[str, tuple[frozenset[type], frozenset[type]]], said: Mapping[str, set[str]]
) -> dict[str, str]:
    """Return the requests that were not answered as the page says: by name, with the answers.

    Parts of a component (a lamp, a network's modem) are none of the page's, and those that the page says a robot has
    only at times may be missing.
    """
    wrong = {}
    parts = {part for needs, some in asked.values() for part in needs | some}
    at_times = {part for part in parts if "only" in kind.nearly.get(part, "")}
    for key, (needs, some) in asked.items():
        missed = {str(ComponentMissing(part)) for part in parts - some - at_times} & said[key]
        if kind.judge(needs, some) != "refused":
            wrong |= {key: ", ".join(missed)} if missed else {}
        elif DONE in said[key]:
            wrong[key] = f"done without {', '.join(part.__name__ for part in needs - kind.components)}"
    return wrong


@pytest.mark.slow
@pytest.mark.parametrize(("back", "body"), KINDS)
async def test_rest_answers_as_the_page_says(kind: tuple[Robot, RobotKind], monkeypatch: pytest.MonkeyPatch) -> None:
    robot, page = kind
    monkeypatch.setattr(generated, "WRONG", 0.0)
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    said = defaultdict[str, set[str]](set)
    async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{door.port}", timeout=120, verify=False) as client:
        generator = Generator((await client.get("/openapi.json")).json(), 1, frozenset(SLEEPY))
        for request in itertools.islice(generator.requests(), ROUNDS * (len(REQUESTS) - len(SLEEPY))):
            reply = await client.request(
                request.method, request.url, params=request.params, headers=request.headers, content=request.content
            )
            assert not generator.problem(request, reply), request
            lacks = reply.status_code == NOT_IMPLEMENTED
            said[request.key].add(reply.text.rpartition(": ")[2] if lacks else str(reply.status_code // 100))
    await door.close()
    asked = {op.key: (op.needs, op.some) for op in REQUESTS if op.key in said}
    assert len(asked) > 100
    assert untruths(page, asked, said) == {}


@pytest.mark.parametrize(("back", "body"), KINDS)
async def test_text_answers_as_the_page_says(kind: tuple[Robot, RobotKind], text_door: Open) -> None:
    robot, page = kind
    client, said, why = await text_door(robot), defaultdict[str, set[str]](set), list[str]()

    def hear(exchange: Exchange) -> None:
        if exchange.direction is Direction.REPLY:
            why.append(exchange.refusal)

    leave = robot.tap.listen(hear)
    for operation in COMMANDS:
        if operation.key in ENDING:
            continue
        shape = shape_of(operation, as_robots=False)
        command = completed(operation.key, shape, {}).partition("`")[2].partition("`")[0]
        why.clear()
        reply = await client.ask(f"{command};")
        said[operation.key].add(DONE if not reply.startswith(REFUSALS) else why[-1] if why else reply)
    leave()
    assert len(said) > 40
    assert untruths(page, {op.key: (op.needs, op.some) for op in COMMANDS if op.key in said}, said) == {}
