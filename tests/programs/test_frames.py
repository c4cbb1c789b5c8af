"""The bytes of a worker's socket, as a hostile worker would send them."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.programs.engine.messages import SHORT, CallMessage, PlainCall, ProtocolViolation, decode
from roboglot.programs.worker.frames import FRAME_MAX, FrameReader, FrameTooLong, frame
from roboglot.programs.worker.values import DEPTH_MAX, PAIRS_MAX, Record, drained, pack, unpack
from tests.narrowing import of_kind

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text() | st.sampled_from(["$", "v", "t"]), inner, max_size=4)
    ),
    max_leaves=12,
)
TEXT = st.text(st.characters(exclude_categories=["Cs"]))
KEYS = TEXT | st.integers() | st.tuples(st.integers(), TEXT)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**4000), 2**4000) | st.floats(allow_nan=False) | TEXT,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(KEYS, inner, max_size=4)
        | st.builds(Record, TEXT, st.dictionaries(TEXT, inner, max_size=3))
    ),
    max_leaves=12,
)


@given(st.lists(st.binary(max_size=300), max_size=8), st.lists(st.integers(0, 2000), max_size=12))
def test_bodies_arrive_whole_however_they_are_cut(bodies: list[bytes], cuts: list[int]) -> None:
    stream = b"".join(map(frame, bodies))
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    reader = FrameReader()
    received = [body for start, end in pairwise(edges) for body in reader.feed(stream[start:end])]
    assert received == bodies


@given(st.binary(max_size=2000))
def test_any_bytes_are_bodies_or_too_long(data: bytes) -> None:
    reader = FrameReader(limit=64)
    try:
        bodies = reader.feed(data)
    except FrameTooLong:
        return
    assert all(len(body) <= 64 for body in bodies)
    assert data.startswith(b"".join(map(frame, bodies)))


def test_a_long_frame_is_refused_by_its_header() -> None:
    assert FrameReader().feed((FRAME_MAX).to_bytes(4, "big")) == []
    with pytest.raises(FrameTooLong):
        FrameReader().feed((FRAME_MAX + 1).to_bytes(4, "big"))


@given(st.binary(max_size=400))
def test_any_body_is_a_message_or_a_violation(body: bytes) -> None:
    try:
        decode(body)
    except ProtocolViolation:
        return


@given(
    st.dictionaries(
        st.sampled_from(["t", "id", "name", "args", "kwargs", "text", "x"]), JSON | st.just("call"), max_size=6
    )
)
@settings(max_examples=100)
def test_any_object_is_a_message_or_a_violation(content: dict[str, Any]) -> None:
    try:
        message = decode(json.dumps(content).encode())
        if isinstance(message, CallMessage):
            drained(message.values())
    except ProtocolViolation:
        return
    assert content["t"] in {"output", "call", "finished", "failed", "checked"}


@given(st.lists(JSON, max_size=5) | JSON, st.just({}) | JSON)
def test_plain_arguments_are_read_as_all_others(args: Any, kwargs: Any) -> None:
    packed, named = json.dumps(args), json.dumps(kwargs)
    body = f'{{"t":"call","id":1,"name":"x","args":{packed},"kwargs":{named}}}'.encode()
    call = decode(body)
    if isinstance(call, PlainCall):
        others = CallMessage(1, "x", msgspec.Raw(packed.encode()), msgspec.Raw(named.encode()))
        assert repr((call.args, call.kwargs)) == repr(drained(others.values()))
    elif len(body) <= SHORT and isinstance(args, list) and isinstance(kwargs, dict):
        assert any(isinstance(arg, list | dict) for arg in (*args, *kwargs.values()))


@given(JSON)
def test_any_json_is_value_or_a_value_error(content: Any) -> None:
    try:
        value = unpack(content)
    except ValueError:
        return
    assert unpack(pack(value)) == value


@given(VALUES)
def test_values_survive_the_way(value: Any) -> None:
    assert unpack(json.loads(json.dumps(pack(value)))) == value


@pytest.mark.parametrize(
    "text", ["[" * 200_000, '{"t":"output","text":' + "[" * 200_000, '{"t":"call","id":1e999}', "NaN", ""]
)
def test_monsters_are_violations(text: str) -> None:
    with pytest.raises(ProtocolViolation):
        decode(text.encode())


def test_unsendable_values_are_refused() -> None:
    assert math.isnan(unpack(pack(math.nan)))
    nested: list[Any] = []
    for _ in range(DEPTH_MAX + 1):
        nested = [nested]
    for value, error in (
        (nested, ValueError),
        (2**5000, ValueError),
        (3j, TypeError),
        (dict.fromkeys(range(PAIRS_MAX + 1), 0), ValueError),
        ({1}, TypeError),
        (b"x", TypeError),
    ):
        with pytest.raises(error):
            pack(value)
    with pytest.raises(ValueError, match="nested"):
        unpack(nested)
    assert pack({str(number): 0 for number in range(PAIRS_MAX + 1)})
    with pytest.raises(ValueError, match="tagged"):
        unpack({"$": "dict", "v": [[number, 0] for number in range(PAIRS_MAX + 1)]})
    with pytest.raises(ValueError, match="key"):
        unpack({"$": "dict", "v": [[{"$": "dict", "v": []}, 1]]})
    zeros = ",".join("0" * 65)
    crowded = of_kind(decode(f'{{"t":"call","id":1,"name":"x","args":[{zeros}],"kwargs":{{}}}}'.encode()), CallMessage)
    with pytest.raises(ProtocolViolation, match="too many"):
        drained(crowded.values())


def test_too_many_values_are_refused_before_making_any() -> None:
    body = json.dumps({"t": "call", "id": 1, "name": "x", "args": [[[]] * 60_000], "kwargs": {}})
    with pytest.raises(ProtocolViolation, match="more values"):
        drained(of_kind(decode(body.encode()), CallMessage).values())
