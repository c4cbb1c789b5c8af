"""The tolerant reader of ``params``, fed with everything."""

from __future__ import annotations

import contextlib
import json

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.cyberdog.text import (
    UNKNOWN_MAX,
    Int32,
    NotJson,
    fitting,
    read_params,
    unknown_names,
    why_unknown,
    write,
)

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)
FIELDS = msgspec.defstruct(
    "Fields", [("n", Int32), ("v", list[float], []), ("b", bool, False), ("s", str, "")], kw_only=True
)


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(NotJson):
        assert isinstance(read_params(text), dict)


@given(st.text(alphabet='{}[]":,0123456789.eE+-truefalsn\\u ', max_size=60))
def test_nearly_json_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(NotJson):
        read_params(text)


@pytest.mark.parametrize("end", ["", "\n"])
@pytest.mark.parametrize("value", ['"\\ud800"', "1e999", "-1e999", "NaN", "Infinity", "9" * 5000, "[" * 100_000])
def test_line_ends_let_nothing_else_in(value: str, end: str) -> None:
    with pytest.raises(NotJson):
        read_params(f'{{"a": {value}, "b": "{end}"}}')


@given(JSON)
def test_all_json_is_read(value: object) -> None:
    read = read_params(json.dumps(value, ensure_ascii=False).encode("utf-8", "ignore").decode())
    assert None not in read.values()


@given(st.dictionaries(st.sampled_from("nvbsx"), JSON))
def test_unfit_values_count_as_absent(values: dict[str, object]) -> None:
    kept = fitting(values, FIELDS)
    assert kept.items() <= values.items() or set(kept) <= set("nvbs")
    msgspec.convert({"n": 0, **kept}, FIELDS, strict=False)  # 303.0 counts as 303


@pytest.mark.parametrize(
    ("value", "kept"), [([0, 0.26, 0], True), ([1, "2"], False), ("0.5", False), ([], True), ([10**400], False)]
)
def test_number_lists(value: object, kept: bool) -> None:
    assert ("v" in fitting({"v": value}, FIELDS)) is kept


@pytest.mark.parametrize(
    ("value", "kept"), [(303, True), (303.0, True), (303.5, False), ("303", False), (2**31, False), (True, False)]
)
def test_numbers(value: object, kept: bool) -> None:
    assert ("n" in fitting({"n": value}, FIELDS)) is kept


def test_few_of_many_unknown_names_are_described() -> None:
    names = [f"n{number}" for number in range(200_000)]
    described = unknown_names(dict.fromkeys(["x", "bb", *names]), FIELDS, frozenset("x"))
    assert list(described) == ["bb", *names[: UNKNOWN_MAX - 1]]
    assert why_unknown("bool", described["bb"]) == "bool is unknown"
    assert why_unknown("N", "n") == "N is unknown; did you mean 'n'?"


def test_deep_nesting_is_refused() -> None:
    with pytest.raises(NotJson):
        read_params('{"a":' * 200_000)


def test_text_goes_out_plain_all_else_as_json() -> None:
    assert write("") == ""
    assert write("{ raw }") == "{ raw }"
    assert write({"result": 0}) == '{"result":0}'
