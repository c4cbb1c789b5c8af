"""Lines as real robots of several builds sent them, and anything else."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.robomaster.replies import FW60, FW70, SPEC, Profile
from roboglot.wire.robomaster.telemetry import (
    AdapterLevel,
    Applause,
    ArmorHit,
    ChassisAttitude,
    ChassisPosition,
    ChassisStatus,
    GameInput,
    GimbalAttitude,
    LinesSeen,
    Target,
    TargetsSeen,
    broadcast_of,
    number_of,
    parse_pushes,
)


def test_a_captured_datagram() -> None:
    data = (
        b"chassis push attitude -0.894 -0.117 0.423 ; status 0 1 0 0 0 0 0 0 0 0 0 ;gimbal push attitude -0.300 -0.100 "
        b";chassis push position 0.001 0.000 ; attitude -0.892 -0.115 0.422 ;"
    )
    assert list(parse_pushes(data)) == [
        ChassisAttitude(-0.894, -0.117, 0.423),
        ChassisStatus(False, True, *[False] * 9),
        GimbalAttitude(-0.3, -0.1),
        ChassisPosition(0.001, 0.0),
        ChassisAttitude(-0.892, -0.115, 0.422),
    ]


def test_captured_events() -> None:
    data = (
        b"armor event hit 1 0 ;armor event hit 2 1 ;sound event applause 2 ;sensor_adapter event io_level (1, 2, 0);;"
    )
    assert list(parse_pushes(data)) == [ArmorHit(1, 0), ArmorHit(2, 1), Applause(2), AdapterLevel(1, 2, 0)]
    assert list(parse_pushes(b"game msg push [0, 6, 1, 0, 0, 255, 1, 87];")) == [GameInput(0, (1, 0, 0, 255, 1, 87))]


def test_recognised_targets_are_parsed() -> None:
    assert list(parse_pushes(b"AI push person 1 0.5 0.5 0.3 0.7;")) == [
        TargetsSeen("person", (Target(0.5, 0.5, 0.3, 0.7),))
    ]
    assert list(parse_pushes(b"AI push people 0 pose 1 4 0.1 0.2 0.3 0.4 ;;")) == [
        TargetsSeen("person", ()),
        TargetsSeen("gesture", (Target(0.1, 0.2, 0.3, 0.4, info=4),)),
    ]
    (lines,) = parse_pushes(b"AI push line 1 " + b"0.1 0.2 30 4 " * 10 + b";")
    assert isinstance(lines, LinesSeen)
    assert [len(line) for line in lines.lines] == [10]
    assert lines.lines[0][9].tangent == 30


@pytest.mark.parametrize("profile", [SPEC, FW60, FW70], ids=lambda profile: profile.name)
@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2), st.tuples(*[st.floats(-1e6, 1e6)] * 3))
def test_pushes_of_our_robots_are_parsed(profile: Profile, xy: list[float], angles: tuple[float, ...]) -> None:
    position, attitude = parse_pushes(profile.push("chassis", ("position", xy), ("attitude", angles), separator=" ; "))
    assert isinstance(position, ChassisPosition)
    assert isinstance(attitude, ChassisAttitude)
    assert (position.x, position.y) == pytest.approx(xy, abs=6e-4)
    assert attitude.yaw == pytest.approx(angles[2], abs=6e-4)


heads = st.sampled_from([b"chassis push ", b"AI push ", b"gimbal push attitude ", b"game msg push [", b"armor event "])
words = st.sampled_from([b"line 1 ", b"person -1 ", b"999999999999 ", b"nan ", b"1 ", b"; ", b"]", b"marker ", b"\xff"])


@given(st.lists(st.one_of(heads, words, st.binary(max_size=9)), max_size=40))
def test_nothing_breaks_it(parts: list[bytes]) -> None:
    list(parse_pushes(b"".join(parts)))
    broadcast_of(b"robot ip " + b"".join(parts))


@pytest.mark.parametrize(
    ("data", "address"),
    [
        (b"robot ip 192.168.1.102", "192.168.1.102"),
        (b"robot ip 192.168.1.102;", "192.168.1.102"),
        (b"robot ip 192.168.1.102 ;\n", "192.168.1.102"),
        (b"robot ip 192.168.1.300", None),
        (b"robot ip here", None),
        (b"", None),
    ],
)
def test_broadcasts(data: bytes, address: str | None) -> None:
    assert broadcast_of(data) == address


@pytest.mark.parametrize("number", ["nan", "inf", "-1e999", "1e10"])
def test_invalid_numbers_are_skipped(number: str) -> None:
    for text in (f"chassis push attitude 0 {number} 0;", f"AI push people 1 {number} 0.5 0.5 0.5;"):
        assert list(parse_pushes(f"{text}chassis push position 1 2;".encode())) == [ChassisPosition(1, 2)]
    with pytest.raises(ValueError, match="no number"):
        number_of(number)
