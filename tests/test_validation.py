"""Answers to values that do not fit: the sender's own field, and what is wanted there, in plain words."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import msgspec
import pytest

from roboglot.validation import PYTHON, read_answer, why_invalid


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


def test_any_other_error_keeps_its_words() -> None:
    assert why_invalid(ValueError("no JSON")) == "no JSON"


def test_a_deep_nest_is_named() -> None:
    with pytest.raises(RecursionError) as raised:
        msgspec.json.decode(b"[" * 100_000)
    assert why_invalid(raised.value) == "JSON is nested too deeply"


@pytest.mark.parametrize("word", ["nan", "NaN", "inf", "-Infinity", "-nan", r"\u006ean", r"\u002dinf", r"n\u0061n"])
def test_a_number_in_an_answer_is_finite(word: str) -> None:
    with pytest.raises(msgspec.ValidationError):
        read_answer(f'{{"cornerX": "{word}"}}'.encode(), Corner)


def test_numbers_in_answers_may_be_text() -> None:
    assert read_answer(b'{"cornerX": "1.5", "y": "2"}', Corner) == Corner(1.5, 2)
    assert read_answer(b'["nan"]', list[str]) == ["nan"]
