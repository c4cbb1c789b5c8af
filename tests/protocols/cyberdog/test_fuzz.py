"""Requests of any shape at a dog that has everything: each is answered in the protocol's form, or still under way."""

from __future__ import annotations

import asyncio
import copy
import json
import logging
import random
from typing import Any

import pytest

from roboglot.model.components.energy.power import Power
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.dispatch import answer
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.testing import Forward
from roboglot.wire.cyberdog.text import NotJson, write
from tests.protocols.cyberdog.phone import PATIENCE, Client, examples

ROUNDS, AT_ONCE, UNDER_WAY_MAX = 12, 32, 40
GONE = {9031, 10006}  # a robot that is off refuses everything: those two come last
VALUES: list[Any] = [
    None, True, False, 0, -1, 1, 2, 5, 7, 13, 111, 303, 0.5, 1.0, -1e300, 1e308, 2**31, 2**63, 10**40, "", "inf",
    "null", "[]", "x" * 500, "\x00", "../..", "\ud800", [], [0, 1, 2], [1e308] * 3, [None], ["a"], [[]], {}, {"": 0},
    {"labelName": 1}, [{"labelName": "a", "physicX": 1e300}], [{}] * 300,
]  # fmt: skip


def broken(rng: random.Random, params: Any) -> Any:
    """``params`` with something else, more or less somewhere in it."""
    if not (isinstance(params, dict | list) and params) or rng.random() < 0.1:
        return copy.deepcopy(rng.choice(VALUES))
    key = rng.choice(list(params) if isinstance(params, dict) else range(len(params)))
    match rng.randrange(4):
        case 0 if isinstance(params, dict):
            params[rng.choice(["type", "data", "id", "x" * 300])] = copy.deepcopy(rng.choice(VALUES))
        case 1:
            del params[key]
        case 2:
            params[key] = copy.deepcopy(rng.choice(VALUES))
        case _:
            params[key] = broken(rng, params[key])
    return params


def requests(rng: random.Random) -> list[tuple[int, Any]]:
    """Requests of every code, a few valid, most of them not."""
    names = {int(operation.key): operation.names or () for operation in TABLE}
    known: dict[int, list[Any]] = {code: [] for code in names}
    for code, params, _ in examples("cyberdog.md"):
        known[code].append(json.loads(params))
    made: list[tuple[int, Any]] = []
    for code, good in known.items():
        for _ in range(ROUNDS):
            params = copy.deepcopy(rng.choice(good)) if good and rng.random() < 0.8 else {}
            for name in () if params else names[code]:
                params[name] = copy.deepcopy(rng.choice(VALUES))
            for _ in range(rng.randrange(3)):
                params = broken(rng, params)
            made.append((code, params))
    rng.shuffle(made)
    return sorted(made, key=lambda request: request[0] in GONE)


@pytest.mark.world("empty", body="cyberdog2")
async def test_requests_of_any_shape_at_a_whole_dog(
    door: CyberDogDoor, client: Client, robot: Robot, forward: Forward, caplog: pytest.LogCaptureFixture
) -> None:
    rng, answers = random.Random(7), list[Any]()
    assert {Firmware, Power} <= set(robot.interfaces)
    dog = door._context
    assert dog

    async def ask(code: int, params: Any) -> None:
        async def reply(value: object) -> None:
            answers.append(json.loads(write(value) or "{}"))

        try:
            last = await answer(Call(code, json.dumps(params), dog, reply))
        except NotJson:  # half a surrogate pair
            return
        if last is not None:
            await reply(last)

    under_way: list[asyncio.Task[None]] = []
    asked = requests(rng)
    for index in range(0, len(asked), AT_ONCE):
        under_way += [asyncio.ensure_future(ask(*request)) for request in asked[index : index + AT_ONCE]]
        await forward(seconds=0.06)
        for one in [one for one in under_way if one.done()]:
            one.result()
        under_way = [one for one in under_way if not one.done()]
        rng.shuffle(under_way)
        while len(under_way) > UNDER_WAY_MAX:
            under_way.pop().cancel()  # its app has left
    for one in under_way:
        one.cancel()
    await asyncio.wait_for(asyncio.gather(*under_way, return_exceptions=True), PATIENCE)
    assert len(answers) > len(asked) / 2
    assert all(isinstance(one, dict) for one in answers)
    assert [record.message for record in caplog.records if record.levelno >= logging.ERROR] == []
    assert await client.ask(10001)
