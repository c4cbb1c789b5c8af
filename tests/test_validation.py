"""Answers to values that do not fit: the sender's own field, and what is wanted there, in plain words."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Annotated, Literal, cast

import msgspec
import pytest

from roboglot.access.tunnel import gateway
from roboglot.access.tunnel.connector import Connector, Refused
from roboglot.access.tunnel.frames import BadFrame, FrameKind, TunnelFrame
from roboglot.access.tunnel.link import TunnelLink
from roboglot.agents import console as agent
from roboglot.validation import CHOICES_MAX, PYTHON, decode_json, read_answer, why_invalid
from roboglot.wire.slamware.chapters.artifact import MetadataError, control_points


class Side(StrEnum):
    LEFT = "left"


class Corner(msgspec.Struct, rename={"x": "cornerX"}):
    x: Annotated[float, msgspec.Meta(ge=0, lt=5)]
    y: int = 0


class Sent(msgspec.Struct, forbid_unknown_fields=True):
    corner: Corner | None = None
    corners: Annotated[list[Corner], msgspec.Meta(min_length=1, max_length=2)] | None = None
    by_number: dict[int, str] = {}
    side: Side = Side.LEFT
    name: Annotated[str, msgspec.Meta(max_length=3, pattern=r"^a\D*")] = "a"
    pair: tuple[int, int] = (0, 0)
    step: Annotated[int, msgspec.Meta(multiple_of=5)] = 0
    either: int | str = 0


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (7, "the value must be an object, not a whole number"),
        ({"corner": {}}, "corner.cornerX is missing"),
        ({"corner": {"cornerX": "far"}}, "corner.cornerX must be a number, not text"),
        ({"corner": {"cornerX": -1}}, "corner.cornerX must be at least 0"),
        ({"corner": {"cornerX": 5}}, "corner.cornerX must be below 5"),
        ({"corner": {"cornerX": 1, "y": 0.5}}, "corner.y must be a whole number, not a fraction"),
        ({"corners": []}, "corners must have at least 1 entries"),
        ({"corners": [{"cornerX": 1}, {}]}, "corners[1].cornerX is missing"),
        ({"by_number": {"one": "1"}}, "a key of by_number must be a whole number, not text"),
        ({True: 1}, "a key of the value must be text"),  # such as `on: push` in YAML
        ({"side": "right"}, "side cannot be 'right'"),
        ({"name": "aaaa"}, "name must have at most 3 characters"),
        ({"name": "b"}, r"name must match ^a\D*"),
        ({"name": None}, "name must be text, not null"),
        ({"pair": [1]}, "pair must have 2 entries, not 1"),
        ({"step": 3}, "step must be a multiple of 5"),
        ({"either": []}, "either must be a whole number or text, not a list"),
        ({"more": 1}, "more is unknown"),
    ],
)
def test_a_misfit_is_named_in_plain_words(sent: object, words: str) -> None:
    with pytest.raises(msgspec.ValidationError) as raised:
        msgspec.convert(sent, Sent)
    assert why_invalid(raised.value) == words


def test_a_field_around_the_value_leads_the_path() -> None:
    with pytest.raises(msgspec.ValidationError) as raised:
        msgspec.convert([{"cornerX": 1, "y": None}], list[Corner])
    assert why_invalid(raised.value, field="corners") == "corners[0].y must be a whole number, not null"
    assert why_invalid(raised.value, field="corners", kinds=PYTHON).endswith("not None")


class Tower(msgspec.Struct):
    height: int = 1

    def __post_init__(self) -> None:
        if self.height < 1:
            raise ValueError("tower.height must be at least 1")


class Town(msgspec.Struct):
    tower: Tower | None = None
    church: Tower | None = None


@pytest.mark.parametrize(
    ("kind", "sent", "words"),
    [
        (Tower, {"height": 0}, "tower.height must be at least 1"),
        (Town, {"tower": {"height": 0}}, "tower.height must be at least 1"),
        (Town, {"church": {"height": 0}}, "church: tower.height must be at least 1"),
    ],
)
def test_sentence_that_names_its_field_has_no_prefix(kind: type, sent: object, words: str) -> None:
    with pytest.raises(msgspec.ValidationError) as raised:
        msgspec.convert(sent, kind)
    assert why_invalid(raised.value) == words


class Speed(StrEnum):
    SLOW = "slow"
    FAST = "fast"


class Walk(msgspec.Struct, tag="walk", tag_field="do", forbid_unknown_fields=True, rename="camel"):
    top_speed: Speed = Speed.SLOW
    later: tuple[int, Speed] = (0, Speed.SLOW)
    gear: Literal[1, 2] = 1


class Sit(msgspec.Struct, tag="sit", tag_field="do", forbid_unknown_fields=True):
    sides: dict[Side, int] = {}


class Plan(msgspec.Struct, forbid_unknown_fields=True):
    steps: list[Walk | Sit] = []
    named: dict[str, Speed | None] = {}


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        ({"steps": [{"do": "walk", "topSpeed": "x"}]}, "steps[0].topSpeed cannot be 'x'; use one of slow, fast"),
        ({"steps": [{"do": "walk", "later": [0, "x"]}]}, "steps[0].later[1] cannot be 'x'; use one of slow, fast"),
        ({"steps": [{"do": "walk", "gear": 3}]}, "steps[0].gear cannot be 3; use one of 1, 2"),
        ({"steps": [{"do": "fly"}]}, "steps[0].do cannot be 'fly'; use one of walk, sit"),
        ({"steps": [{"do": "sit", "sides": {"x": 1}}]}, "a key of steps[0].sides cannot be 'x'; use left"),
        ({"named": {"a": "x"}}, "named[...] cannot be 'x'; use one of slow, fast"),
        ({"steps": [{"do": "sit", "zzz": 1}]}, "steps[0].zzz is unknown; there are topSpeed, later, gear, sides"),
        ({"steps": [{"do": "walk", "topSped": 1}]}, "steps[0].topSped is unknown; did you mean 'topSpeed'?"),
        ({"zzz": 1}, "zzz is unknown; there are steps, named"),
        ({"topSpeed": "slow"}, "topSpeed is unknown; it belongs in steps"),
        ({"steps": [{"do": "sit", "named": {}}]}, "steps[0].named is unknown; it belongs in the outermost object"),
        ({"named": 1}, "named must be an object, not a whole number"),
    ],
)
def test_allowed_words_are_named(sent: object, words: str) -> None:
    with pytest.raises(msgspec.ValidationError) as raised:
        msgspec.convert(sent, Plan)
    assert why_invalid(raised.value, wanted=Plan) == words


class Inner(msgspec.Struct, forbid_unknown_fields=True):
    robot: str = ""


class Outer(msgspec.Struct, forbid_unknown_fields=True):
    robots: list[str] = []
    inner: Inner | None = None


def test_near_fields_come_before_distant_homes() -> None:
    with pytest.raises(msgspec.ValidationError) as raised:
        msgspec.convert({"inner": {"robots": "a"}}, Outer)
    assert why_invalid(raised.value, wanted=Outer) == "inner.robots is unknown; did you mean 'robot'?"


def test_long_lists_of_words_are_left_out() -> None:
    number = StrEnum("number", [f"n{i}" for i in range(CHOICES_MAX + 1)])  # type: ignore[misc]
    with pytest.raises(msgspec.ValidationError) as raised:
        msgspec.convert("x", number)
    assert why_invalid(raised.value, wanted=number) == "the value cannot be 'x'"


def test_any_other_error_keeps_its_words() -> None:
    assert why_invalid(ValueError("no JSON")) == "no JSON"


def test_a_deep_nest_is_named() -> None:
    with pytest.raises(RecursionError) as raised:
        msgspec.json.decode(b"[" * 100_000)
    assert why_invalid(raised.value) == "JSON is nested too deeply"


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (b'"\xff"', "the text is not UTF-8"),
        (b'{"x"', "JSON is incomplete"),
        (b'{"x": {"y": 1e400}}', "a number is out of range"),
        (b'{"x": [1' + b"0" * 5000 + b"]}", "a number is out of range"),
    ],
)
def test_broken_json_is_named_in_plain_words(sent: bytes, words: str) -> None:
    with pytest.raises(ValueError) as raised:  # noqa: PT011 - of two libraries
        msgspec.json.decode(sent)
    assert why_invalid(raised.value) == words


@pytest.mark.parametrize("word", ["nan", "NaN", "inf", "-Infinity", "-nan", r"\u006ean", r"\u002dinf", r"n\u0061n"])
def test_a_number_in_an_answer_is_finite(word: str) -> None:
    with pytest.raises(msgspec.ValidationError):
        read_answer(f'{{"cornerX": "{word}"}}'.encode(), Corner)


def test_numbers_in_answers_may_be_text() -> None:
    assert read_answer(b'{"cornerX": "1.5", "y": "2"}', Corner) == Corner(1.5, 2)
    assert read_answer(b'["nan"]', list[str]) == ["nan"]


class Named(msgspec.Struct):
    name: str = ""


LEVELS = 1_000_000  # Python 3.14 counts the stack's bytes, and skips 200,000 levels of an unknown field
STRANGE = {
    "deep": b'{"x":' + LEVELS * b"[",
    "closed": b'{"x":' + LEVELS * b"[" + LEVELS * b"]" + b"}",
    "no text": b'"\xff"',
}


@pytest.mark.parametrize("kind", STRANGE)
@pytest.mark.parametrize(
    ("read", "error"),
    [
        (lambda data: decode_json(data, Named), msgspec.DecodeError),
        (lambda data: read_answer(data, Named), msgspec.DecodeError),
        (gateway._hello, BadFrame),
        (lambda data: agent._decoded(data, Named), agent.Refused),
        (lambda data: control_points({"control_point1": data.decode("latin-1")}), MetadataError),
    ],
)
def test_strange_json_raises_one_error(kind: str, read: Callable[[bytes], object], error: type[Exception]) -> None:
    """Python's RecursionError is no error of msgspec's: a stranger's greeting ended in a traceback."""
    with pytest.raises(error):
        read(STRANGE[kind])


@pytest.mark.parametrize("greeting", [STRANGE["deep"], b"{}", b'{"tcp": [70000], "callbacks": [], "broadcasts": []}'])
async def test_strange_greetings_of_gateways_are_refused(greeting: bytes) -> None:
    class Link:
        def send(self, *_frame: object) -> None:
            pass

        async def first(self) -> TunnelFrame:
            return TunnelFrame(FrameKind.WELCOME, 0, greeting)

    connector = object.__new__(Connector)
    connector._robot = connector._token = ""
    with pytest.raises(Refused, match="greeting"):
        await connector._greet(cast(TunnelLink, Link()))


@pytest.mark.parametrize("sent", [{"x" * 100_000: 1}, {"side": "y" * 100_000}, {"by_number": {"z" * 100_000: 1}}])
def test_sentences_quote_only_the_beginning(sent: object) -> None:
    with pytest.raises(msgspec.ValidationError) as invalid:
        msgspec.convert(sent, Sent)
    assert len(why_invalid(invalid.value, wanted=Sent)) < 1000
