"""Requests made from the OpenAPI document: each has an answer, no fault of the server, as the document describes it."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections import Counter

import httpx
import pytest

from roboglot.protocols.slamware.routes import ALIASES
from roboglot.protocols.slamware.table import TABLE
from roboglot.testing import Forward
from tests.protocols.slamware.generated import SILENCING, Generator, tell

COUNT = 3000  # ten of each operation; run by hand, generated.py makes any number
QUICK = 900  # three of each
TRIES_MAX = 200  # of 50 ms of robot time each: longer means that it hangs


@pytest.mark.world("empty")
@pytest.mark.parametrize(
    ("seed", "count"), [(1, QUICK), *(pytest.param(n, COUNT, marks=pytest.mark.slow) for n in (1, 2))]
)
async def test_documented_requests_get_documented_answers(
    client: httpx.AsyncClient, forward: Forward, caplog: pytest.LogCaptureFixture, seed: int, count: int
) -> None:
    await forward(seconds=1)
    generator = Generator((await client.get("/openapi.json")).json(), seed)
    generator.binaries.append((await client.get("/api/core/slam/v1/maps/stcm")).content)
    statuses: dict[str, Counter[int]] = {}
    for request in itertools.islice(generator.requests(), count):
        asked = asyncio.create_task(
            client.request(
                request.method, request.url, params=request.params, headers=request.headers, content=request.content
            )
        )
        await asyncio.wait([asked], timeout=0.05)
        for _ in range(TRIES_MAX):
            if asked.done():
                break
            await forward(seconds=0.05)
        assert asked.done(), f"no answer: {request}"
        reply = await asked
        problem = generator.problem(request, reply)
        assert not problem, tell(request, reply, problem)
        statuses.setdefault(request.key, Counter())[reply.status_code] += 1
    assert statuses.keys() == ({operation.key for operation in TABLE} | ALIASES.keys()) - SILENCING
    # The requests are useful: most operations were carried out.
    carried_out = {key for key, seen in statuses.items() if seen.keys() & {200, 204}}
    assert len(carried_out) > 0.75 * len(statuses), statuses.keys() - carried_out
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR]


def test_the_judge_finds_what_is_wrong() -> None:
    point = {"type": "object", "required": ["x"], "properties": {"x": {"type": "number", "minimum": 0}}}
    document = {"paths": {}, "components": {"schemas": {"Point": point}}}
    judge = Generator(document, 1)
    schema = {
        "type": "array",
        "maxItems": 2,
        "items": {"anyOf": [{"$ref": "#/components/schemas/Point"}, {"type": "null"}]},
    }
    assert judge.misfit([{"x": 1}, None], schema) == ""
    for wrong in ([{"x": -1}], [{}], [{"x": True}], [5], [{"x": "1"}], {}, [None] * 3, None):
        assert judge.misfit(wrong, schema), wrong
    assert judge.misfit("b", {"enum": ["a"]})
    assert judge.misfit({"b": 1}, {"type": "object", "additionalProperties": {"type": "string"}})
