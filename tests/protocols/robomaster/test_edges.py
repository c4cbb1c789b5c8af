"""Each command of the manual: valid, at the edges of each range, just outside, of the wrong kind, missing, twice.

The ranges are typed from the manual and know nothing of the code's.
"""

import asyncio
import re
from collections.abc import Iterator

import pytest

from roboglot.wire.contracts import contract
from tests.drivers.settling import settle

PARSE_ERROR = "command format error: command parse error;"
OK, FAIL = "ok;", "fail;"
ON_OFF = "on off"
RATES = "1 5 10 20 30 50"
SMALL = 0.001  # distance of "just outside" for decimal numbers

Range = tuple[float, float] | str  # closed ranges, or words
# Template -> ranges. ``wait`` marks those that answer at the end unless stated otherwise.
COMMANDS: dict[str, dict[str, Range]] = {
    "robot mode {mode}": {"mode": "chassis_lead gimbal_lead free"},
    "chassis speed x {x} y {y} z {z}": {"x": (-3.5, 3.5), "y": (-3.5, 3.5), "z": (-600.0, 600.0)},
    "chassis wheel w1 {w1} w2 {w2} w3 {w3} w4 {w4}": {f"w{n}": (-1000.0, 1000.0) for n in (1, 2, 3, 4)},
    "chassis move x {x} y {y} z {z} vxy {vxy} vz {vz}": {
        "x": (-5.0, 5.0), "y": (-5.0, 5.0), "z": (-1800.0, 1800.0), "vxy": (SMALL, 3.5), "vz": (SMALL, 600.0),
    },
    "chassis push position {p} pfreq {pf} attitude {a} afreq {af} status {s} sfreq {sf} freq {f}": {
        "p": ON_OFF, "pf": RATES, "a": ON_OFF, "af": RATES, "s": ON_OFF, "sf": RATES, "f": RATES,
    },
    "gimbal speed p {p} y {y}": {"p": (-450.0, 450.0), "y": (-450.0, 450.0)},
    "gimbal move p {p} y {y} vp {vp} vy {vy} wait_for_complete false": {
        "p": (-55.0, 55.0), "y": (-55.0, 55.0), "vp": (SMALL, 540.0), "vy": (0.0, 540.0),
    },
    "gimbal moveto p {p} y {y} vp {vp} vy {vy} wait_for_complete false": {
        "p": (-25.0, 30.0), "y": (-250.0, 250.0), "vp": (SMALL, 540.0), "vy": (0.0, 540.0),
    },
    "gimbal push attitude {a} afreq {f}": {"a": ON_OFF, "f": RATES},
    "blaster bead {num}": {"num": (1, 5)},
    "armor sensitivity {value}": {"value": (1, 10)},
    "armor event hit {switch}": {"switch": ON_OFF},
    "sound event applause {switch}": {"switch": ON_OFF},
    "pwm value {mask} {value}": {"mask": (0, 65535), "value": (0.0, 100.0)},
    "pwm freq {mask} {value}": {"mask": (0, 65535), "value": (1, 50000)},
    "led control comp {comp} r {r} g {g} b {b} effect {effect}": {
        "comp": "all top_all top_left top_right bottom_all bottom_front bottom_back bottom_left bottom_right",
        "r": (0, 255), "g": (0, 255), "b": (0, 255), "effect": "solid off pulse blink",
    },
    "sensor_adapter adc id {id} port {port} ?": {"id": (1, 6), "port": (1, 2)},
    "sensor_adapter io_level id {id} port {port} ?": {"id": (1, 6), "port": (1, 2)},
    "sensor_adapter pulse_period id {id} port {port}": {"id": (1, 6), "port": (1, 2)},
    "sensor_adapter pulse_period id {id} port {port} ?": {"id": (1, 6), "port": (1, 2)},
    "sensor_adapter event io_level {switch}": {"switch": ON_OFF},
    "ir_distance_sensor measure {switch}": {"switch": ON_OFF},
    "ir_distance_sensor distance {id} ?": {"id": (1, 4)},
    "servo angle id {id} angle {angle}": {"id": (1, 3), "angle": (-180.0, 180.0)},
    "servo speed id {id} speed {speed}": {"id": (1, 3), "speed": (-1800.0, 1800.0)},
    "servo angle id {id} ?": {"id": (1, 3)},
    "robotic_arm move x {x} y {y}": {"x": "0 1", "y": "0 1"},
    "robotic_arm moveto x {x} y {y}": {"x": "5 4", "y": "4 5"},
    "robotic_gripper open leve {level}": {"level": (1, 4)},
    "robotic_gripper close leve {level}": {"level": (1, 4)},
    "AI attribute line_color {line} marker_color {marker} marker_dist {dist}": {
        "line": "red blue green", "marker": "red blue", "dist": (0.5, 3.0),
    },
    "AI push person {switch}": {"switch": ON_OFF},
    "AI push gesture {switch}": {"switch": ON_OFF},
    "AI push marker {switch} line {other}": {"switch": ON_OFF, "other": ON_OFF},
    "AI push robot {switch}": {"switch": ON_OFF},
    "camera exposure {level}": {"level": "default small medium large"},
}  # fmt: skip
# Without parameters; their answers.
PLAIN = {
    "command": "Already in SDK mode;", "robot mode ?": r"chassis_lead;", "robot battery ?": r"\d+;",
    "chassis speed ?": r"(\S+ ){6}\S+;", "chassis position ?": r"(\S+ ){2}\S+;", "chassis attitude ?": r"(\S+ ){2}\S+;",
    "chassis status ?": r"([01] ){10}[01];", "gimbal attitude ?": r"\S+ \S+;", "gimbal suspend": OK,
    "gimbal resume": OK, "gimbal recenter wait_for_complete false": OK, "blaster bead ?": "1;", "blaster fire": OK,
    "armor sensitivity ?": "5;", "servo stop": OK, "robotic_arm recenter": OK, "robotic_arm stop": OK,
    "robotic_arm position ?": r"\S+ \S+;", "robotic_gripper status ?": "[012];", "stream on": OK, "stream off": OK,
    "audio on": OK, "audio off": OK, "game_msg on": OK, "game_msg off": OK, "quit": OK,
}  # fmt: skip
ANY_NUMBER = r"-?[\d.]+;"
ALONE_IS_FINE = {"servo stop", "robotic_gripper open", "robotic_gripper close", "gimbal recenter"}

pytestmark = pytest.mark.world("empty", body="robomaster_ep")


def key_of(text: str) -> str:
    """Return the contract's key of a command."""
    words = [word for word in text.split() if not word.startswith("{")]
    return " ".join(words[:2]) + (" ?" if words[-1] == "?" and words[1] != "?" and len(words) > 2 else "")


def fill(template: str, ranges: dict[str, Range], **chosen: object) -> str:
    """Fill in harmless values for what wasn't chosen."""
    harmless = {n: r.split()[0] if isinstance(r, str) else _text(max(r[0], min(r[1], 1))) for n, r in ranges.items()}
    return template.format(**harmless | {name: str(value) for name, value in chosen.items()})


def _text(number: float) -> str:
    return f"{number:.6f}".rstrip("0").rstrip(".") if isinstance(number, float) else str(number)


def cases(template: str, ranges: dict[str, Range]) -> Iterator[tuple[str, str]]:
    """Text and answer (a pattern)."""
    right = ANY_NUMBER if template.endswith("?") or "pulse_period" in template else OK
    yield fill(template, ranges), right
    for name, allowed in ranges.items():
        if isinstance(allowed, str):
            inside, outside = allowed.split(), ["sideways", "7777"]
        else:
            low, high = allowed
            step = SMALL if isinstance(low, float) else 1
            inside = [_text(low), _text(high)]
            outside = [_text(low - step), _text(high + step), "sideways", "nan", "1e999", "0x"]
            outside += ["1.5"] if isinstance(low, int) else []
        yield from ((fill(template, ranges, **{name: value}), right) for value in inside)
        yield from ((fill(template, ranges, **{name: value}), FAIL) for value in outside)
        if (word := re.search(rf"(\w+) \{{{name}\}}", template)) and word[1] not in template.split()[:2]:
            twice = template.replace(word[0], f"{word[1]} sideways {word[0]}")
            yield fill(twice, ranges, **{name: inside[-1]}), right  # the last one counts
            yield fill(template.replace(word[0], f"{word[0]} {word[1]} sideways"), ranges), FAIL
    bare = " ".join(word for word in template.split()[:2] if not word.startswith("{"))
    if bare not in ALONE_IS_FINE:
        yield bare + " ?" * template.endswith("?"), PARSE_ERROR
    if not template.endswith("?") and f"{bare} ?" not in PLAIN and f"{bare} ?" not in {key_of(t) for t in COMMANDS}:
        yield f"{bare} ?", PARSE_ERROR


def test_the_table_has_every_command() -> None:
    keys = {key_of(template) for template in COMMANDS} | {key.replace(" wait_for_complete false", "") for key in PLAIN}
    assert {row.key for row in contract("robomaster") if not row.key.startswith("> ")} - keys == set()


async def play(client, robot, text: str) -> str:
    client.send(f"{text};")
    answer = asyncio.ensure_future(client.reply())
    for _ in range(400):
        await settle()
        if answer.done():
            break
        await robot.clock.advance(0.05)
    return await answer


@pytest.mark.slow
async def test_edges(client, robot) -> None:
    """Each from a fresh session, so that none depends on another."""
    wrong = {}
    every = [case for template, ranges in COMMANDS.items() for case in cases(template, ranges)] + list(PLAIN.items())
    assert len(every) > 600
    for text, right in every:
        if text.startswith("gimbal moveto"):  # an axis in its place needs no speed
            assert await play(client, robot, "gimbal recenter wait_for_complete true") == OK
        got = await play(client, robot, text)
        if not re.fullmatch(right, got):
            wrong[text] = (got, right)
        if text != "quit":
            assert await play(client, robot, "quit") == OK
        assert await play(client, robot, "command") == OK
    assert not wrong


async def test_nothing_works_before_command(connect) -> None:
    client = await connect()
    texts = [fill(*item) for item in COMMANDS.items()] + [t for t in PLAIN if t not in ("command", "quit")]
    answers = {text: await client.ask(f"{text};") for text in texts}
    assert answers == dict.fromkeys(texts, "not in sdk mode;")
