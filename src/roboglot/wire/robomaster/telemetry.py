"""Unsolicited messages of the robot as values: pushes, events and the broadcast, in the forms of all known builds.

Units, signs and numbers are the EP's own: m, degrees, x forward, y right, yaw clockwise, pitch up. ``hear`` parses a
datagram or the texts of the event port, and ignores unreadable texts. Knows no sockets.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from ipaddress import IPv4Address

from roboglot.values import dataclass

TEXT_MAX = 8192  # most bytes of a datagram that are read
TARGETS_MAX = 128
POINTS_PER_LINE = 10
KEYS_AND_MOUSE = 0  # cmd_id of a game's messages; the others carry a match's score
RAW_MAX = 1023  # full scale of the adapters' converters


@dataclass(frozen=True, slots=True)
class ChassisPosition:
    """Position since power-on, m."""

    x: float
    y: float


@dataclass(frozen=True, slots=True)
class ChassisAttitude:
    """Degrees."""

    pitch: float
    roll: float
    yaw: float


@dataclass(frozen=True, slots=True)
class ChassisStatus:
    """State of the chassis: eleven flags, in the manual's order."""

    static: bool
    uphill: bool
    downhill: bool
    on_slope: bool
    pick_up: bool
    slip: bool
    impact_x: bool
    impact_y: bool
    impact_z: bool
    roll_over: bool
    hill_static: bool


@dataclass(frozen=True, slots=True)
class GimbalAttitude:
    """Degrees."""

    pitch: float
    yaw: float


@dataclass(frozen=True, slots=True)
class Target:
    """A recognised object: its centre and size as parts of the picture; ``info``: number of the gesture or marker."""

    x: float
    y: float
    width: float
    height: float
    info: int | None = None


@dataclass(frozen=True, slots=True)
class LinePoint:
    """Point of a line: x and y as parts of the picture, tangent in degrees, curvature 0 to 10."""

    x: float
    y: float
    tangent: float
    curvature: float


@dataclass(frozen=True, slots=True)
class TargetsSeen:
    """All targets of one ``kind`` in a picture: person, gesture, marker or robot."""

    kind: str
    targets: tuple[Target, ...]


@dataclass(frozen=True, slots=True)
class LinesSeen:
    """Lines in a picture, each of ten points, the nearest first."""

    lines: tuple[tuple[LinePoint, ...], ...]


@dataclass(frozen=True, slots=True)
class ArmorHit:
    """Hit on plate 1 to 6 (rear, front, left, right, gimbal left, gimbal right); type 0 bead, 1 collision, 2 hand."""

    index: int
    type: int


@dataclass(frozen=True, slots=True)
class Applause:
    """Number of claps in a row."""

    count: int


@dataclass(frozen=True, slots=True)
class AdapterLevel:
    """New level, 0 or 1, of an input of a sensor adapter."""

    id: int
    port: int
    level: int


@dataclass(frozen=True, slots=True)
class GameInput:
    """Input of the pilot; ``data`` for cmd_id 0: buttons, mouse x, mouse y, seq, number of keys, keys."""

    cmd_id: int
    data: tuple[int, ...]


Telemetry = (
    ChassisPosition | ChassisAttitude | ChassisStatus | GimbalAttitude | TargetsSeen | LinesSeen | ArmorHit | Applause
    | AdapterLevel | GameInput
)  # fmt: skip

KINDS = {"people": "person", "person": "person", "pose": "gesture", "gesture": "gesture", "marker": "marker",
         "robot": "robot", "line": "line"}  # fmt: skip
WITH_INFO = frozenset({"gesture", "marker"})
_ATTRIBUTES: dict[tuple[str, str], Callable[[Sequence[str]], Telemetry]] = {
    ("chassis", "position"): lambda words: ChassisPosition(*_floats(words, 2)),
    ("chassis", "attitude"): lambda words: ChassisAttitude(*_floats(words, 3)),
    ("chassis", "status"): lambda words: status_of(words),
    ("gimbal", "attitude"): lambda words: GimbalAttitude(*_floats(words, 2)),
}
_EVENTS: tuple[tuple[re.Pattern[str], Callable[..., Telemetry]], ...] = (
    (re.compile(r"armor event hit (\d{1,3}) (\d{1,3})"), ArmorHit),
    (re.compile(r"sound event applause (\d{1,9})"), Applause),
    (re.compile(r"sensor_adapter event io_level \((\d{1,3}), ?(\d{1,3}), ?(\d{1,3})\)"), AdapterLevel),
)
NUMBER_MAX = 1e9
_GAME = re.compile(r"game msg push \[(-?\d{1,9}(?:, ?-?\d{1,9}){0,63})\]")
_BROADCAST = re.compile(r"robot ip ([0-9.]{7,15}) ?;?")


def parse_pushes(data: bytes) -> Iterator[Telemetry]:
    """Yield the messages in a datagram of the push port, or in whole texts of the event port."""
    module = ""
    for text in data[:TEXT_MAX].decode(errors="replace").split(";"):
        words = text.split()
        if words[1:2] == ["push"]:
            module, words = words[0], words[2:]
        try:
            if not words:
                continue
            if module == "AI":
                yield from _seen(words)
            elif (module, words[0]) in _ATTRIBUTES:  # real robots name the module once and continue after a `;`
                yield _ATTRIBUTES[module, words[0]](words[1:])
            else:
                yield from _event(" ".join(text.split()))
        except ValueError:  # not numbers, or too few
            continue


def broadcast_of(data: bytes) -> str | None:
    """Return the address in ``robot ip A.B.C.D``, with or without ``;``; None for any other text."""
    if found := _BROADCAST.fullmatch(data[:TEXT_MAX].decode(errors="replace").strip()):
        try:
            return str(IPv4Address(found[1]))
        except ValueError:
            return None
    return None


def status_of(words: Sequence[str]) -> ChassisStatus:
    """Return the status in eleven words of 0 or 1. Raises ValueError."""
    if len(words) != len(fields(ChassisStatus)) or not set(words) <= {"0", "1"}:
        raise ValueError(f"no chassis status: {' '.join(words)}")
    return ChassisStatus(*(word == "1" for word in words))


def _floats(words: Sequence[str], count: int) -> list[float]:
    if len(words) != count:
        raise ValueError(f"{count} numbers expected, not {len(words)}")
    return [number_of(word) for word in words]


def number_of(word: str) -> float:
    """Parse a number. Raises ValueError, also for one that is not finite or too large."""
    number = float(word)
    if not abs(number) <= NUMBER_MAX:
        raise ValueError(f"no number of a robot's: {word}")
    return number


def _event(text: str) -> Iterator[Telemetry]:
    for pattern, kind in _EVENTS:
        if found := pattern.fullmatch(text):
            yield kind(*(int(group) for group in found.groups()))
    if found := _GAME.fullmatch(text):
        cmd_id, _, *data = (int(number) for number in found[1].split(","))
        yield GameInput(cmd_id, tuple(data))


def _seen(words: Sequence[str]) -> Iterator[Telemetry]:
    """Yield the objects in ``person 1 0.5 0.5 0.3 0.7``; real robots list several kinds in one text."""
    rest = list(reversed(words))
    while rest:
        kind, count = KINDS.get(rest.pop(), ""), int(rest.pop() if rest else "x")
        size = POINTS_PER_LINE * 4 if kind == "line" else 5 if kind in WITH_INFO else 4
        if not kind or not 0 <= count <= TARGETS_MAX or len(rest) < count * size:
            raise ValueError("not what an AI push looks like")
        yield _objects(kind, [[number_of(rest.pop()) for _ in range(size)] for _ in range(count)])


def _objects(kind: str, seen: Sequence[Sequence[float]]) -> Telemetry:
    """Return the objects of one kind from the numbers of each."""
    if kind == "line":
        return LinesSeen(tuple(tuple(LinePoint(*t[at : at + 4]) for at in range(0, len(t), 4)) for t in seen))
    if kind in WITH_INFO:
        return TargetsSeen(kind, tuple(_target(t[1:], int(t[0])) for t in seen))
    return TargetsSeen(kind, tuple(_target(t) for t in seen))


def _target(box: Sequence[float], info: int | None = None) -> Target:
    x, y, width, height = box
    return Target(x, y, width, height, info)
