"""The forms of answers, pushes and the broadcast in the default profile."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.robomaster.replies import FW60, FW70, PROFILES, SPEC, Profile, Reply


def test_fixed_answers_and_the_sequence_number() -> None:
    assert SPEC.result(Reply.OK) == b"ok;"
    assert SPEC.result(Reply.OK, 0) == b"ok seq 0 ;"
    assert SPEC.result(Reply.PARSE_ERROR, 3) == b"command format error: command parse error seq 3 ;"


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_clients_that_split_at_blanks_read_the_number(profile: Profile) -> None:
    for answer in (profile.result(Reply.OK, 7), profile.result(Reply.FAIL, 7), profile.values((1, 2.0), 7)):
        words = answer.decode().split(" ")
        assert int(words[words.index("seq") + 1]) == 7


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((87,), b"87;"),
        (("chassis_lead",), b"chassis_lead;"),
        ((57.3,), b"57.3;"),
        ((1.0, -0.00004, 20.12345, 100), b"1.000 0.000 20.123 100;"),
    ],
)
def test_values(values: tuple[float | str, ...], text: bytes) -> None:
    assert SPEC.values(values) == text


def test_pushes_and_broadcast() -> None:
    assert SPEC.push("chassis", ("attitude", (0.1, 1.0, -3.0))) == b"chassis push attitude 0.100 1.000 -3.000;"
    assert SPEC.push("chassis", ("status", (1, 0))) == b"chassis push status 1 0;"
    assert SPEC.broadcast("192.168.1.102") == b"robot ip 192.168.1.102"


def test_builds_of_robots_word_things_their_way() -> None:
    assert (FW60.result(Reply.OK), FW60.values((1, 2.0))) == (b"ok", b"1 2.000 ")
    assert (FW70.result(Reply.OK), FW70.values((1, 2.0)), FW70.values((87,))) == (b"ok;", b"1 2.000 ;", b"87 ;")
    both = (("position", (0.1, 0.2)), ("status", (1, 0)))
    assert FW70.push("chassis", *both) == b"chassis push position 0.100 0.200 ; status 1 0 ;;"
    assert FW60.event("armor event hit 1 0") == b"armor event hit 1 0 ;"
    assert FW70.broadcast("192.168.1.102") == b"robot ip 192.168.1.102"
    assert FW70.game((0, 6, 1, 0, 0, 255, 1, 87)) == b"game msg push [0, 6, 1, 0, 0, 255, 1, 87];"


@given(st.floats())
def test_number_is_rounded_and_never_minus_nothing(number: float) -> None:
    assert SPEC.values((number, 1)) == f"{round(number, 3) + 0.0:.3f} 1;".encode()
