"""Taking a command's text apart."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.robomaster.commands import SEQ_MAX, Command, Malformed, parameters_of, parse, value_of

word = st.from_regex(r"[A-Za-z0-9_.+-]{1,12}", fullmatch=True).filter(lambda text: text != "seq")


@pytest.mark.parametrize(
    ("text", "command"),
    [
        ("command", Command(("command",))),
        ("robot mode ?", Command(("robot", "mode"), query=True)),
        ("robot  mode\t?", Command(("robot", "mode"), query=True)),
        ("command seq 1", Command(("command",), seq=1)),
        ("robot mode ? seq 0x1F", Command(("robot", "mode"), query=True, seq=31)),
        ("chassis move x 1 seq 7 what follows is ignored", Command(("chassis", "move", "x", "1"), seq=7)),
        ("seq 3", Command(("seq", "3"))),
        ("?", Command(("?",))),
    ],
)
def test_a_text_is_read(text: str, command: Command) -> None:
    assert parse(text) == command


@pytest.mark.parametrize(
    ("text", "reply"),
    [
        ("command seq", "command format error: no seq value"),
        ("command seq x", "command format error: seq parse error"),
        ("command seq 1.5", "command format error: seq parse error"),
        ("command seq true", "command format error: seq parse error"),
        ("command seq -1", "command format error: seq parse error"),
        (f"command seq {SEQ_MAX + 1}", "command format error: seq parse error"),
        ("", "command format error: command parse error"),
        ("robot mode free\nrobot mode ?", "command format error: command parse error"),
    ],
)
def test_a_malformed_text_brings_its_answer(text: str, reply: str) -> None:
    with pytest.raises(Malformed) as refusal:
        parse(text)
    assert refusal.value.reply == reply


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("7", 7),
        ("-7", -7),
        ("+7", 7),
        ("0x1f", 31),
        ("0.5", 0.5),
        (".5", 0.5),
        ("-1.5e-1", -0.15),
        ("30.000000", 30),
        ("true", True),
        ("False", False),
        ("free", "free"),
        ("1_000", "1_000"),
        ("nan", "nan"),
        ("inf", "inf"),
        ("٣", "٣"),
        ("", ""),
    ],
)
def test_a_word_is_what_it_looks_like(text: str, value: object) -> None:
    read = value_of(text)
    assert (read, type(read)) == (value, type(value))


def test_the_longest_name_is_tried_first() -> None:
    assert list(parse("robot mode free").keys) == [("robot mode", ("free",)), ("robot", ("mode", "free"))]
    assert list(parse("version ?").keys) == [("version ?", ())]


@pytest.mark.parametrize(
    ("words", "names", "values"),
    [
        ("x 1 y 2.5", "x y z", {"x": 1, "y": 2.5}),
        ("y 2 x 1", "x y z", {"x": 1, "y": 2}),
        ("w 9 x 1 what ever", "x y z", {"x": 1}),
        ("x 1 x 2", "x y z", {"x": 2}),
        ("x y 2", "x y z", {"x": "", "y": 2}),
        ("z", "x y z", {"z": ""}),
        ("x 1", "", {}),
    ],
)
def test_parameters_are_found_by_name(words: str, names: str, values: dict[str, object]) -> None:
    assert parameters_of(words.split(), names.split()) == values


@pytest.mark.parametrize(
    ("words", "bare", "values"),
    [
        ("free", "mode", {"mode": "free"}),
        ("mode free", "mode", {"mode": "free"}),
        ("leve 1", "level", {"level": 1}),
        ("", "mode", {}),
        ("1 50", "port data", {"port": 1, "data": 50}),
        ("data 50 port 0x3f", "port data", {"port": 63, "data": 50}),
        ("1", "port data", {"port": 1}),
        ("data 50 1", "port data", {"port": 1, "data": 50}),
    ],
)
def test_bare_words_need_no_name(words: str, bare: str, values: dict[str, object]) -> None:
    assert parameters_of(words.split(), bare.split(), bare.split()) == values


@given(st.text(max_size=200))
def test_parsing_never_breaks(text: str) -> None:
    try:
        command = parse(text)
    except Malformed:
        return
    assert command.words
    parameters_of(command.words, ("x", "y"))


@given(st.text(max_size=40))
def test_a_value_is_never_not_a_number(text: str) -> None:
    value = value_of(text)
    assert not (isinstance(value, float) and math.isnan(value))


@given(
    st.lists(word, min_size=1, max_size=8),
    st.booleans(),
    st.none() | st.integers(min_value=0, max_value=SEQ_MAX),
)
def test_written_commands_are_read_back(words: list[str], query: bool, seq: int | None) -> None:
    command = Command(tuple(words), query, seq)
    assert parse(str(command)) == command


@given(st.floats(min_value=-1e9, max_value=1e9))
def test_every_float_that_python_prints_is_read(number: float) -> None:
    assert value_of(str(number)) == number
