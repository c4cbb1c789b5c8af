"""The pages' transcripts, English and Chinese, played line by line against the door; every command is in them."""

import asyncio
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.model.components.interaction.input_device import InputDevice, MouseButton
from roboglot.model.geometry import Point, Pose
from roboglot.model.sound import claps
from roboglot.protocols.robomaster.table import TABLE
from roboglot.wire.contracts import contract
from tests.drivers.settling import settle
from tests.protocols.robomaster.text_client import ADDRESS

DOCS = Path(__file__).parents[4] / "docs/protocols"
PAGES = {page.stem: page for page in (DOCS / "robomaster.md", DOCS / "robomaster.zh.md")}
TRANSCRIPT = re.compile(r"^```text\n(> .*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?![\d.])")
CAUSES = {  # comments of both pages
    "a hand taps the rear plate": "hand", "有人拍后装甲板": "hand",
    "someone claps twice": "claps", "有人鼓掌两次": "claps",
    "2.5 V at port 2 of adapter 3": "volts", "3 号转接板 2 号端口接上 2.5 V": "volts",
    "the pilot holds W and the left button": "keys", "操作手按住 W 与鼠标左键": "keys",
    "it stands before a marker": "place", "它站在视觉标签前": "place",
}  # fmt: skip


def transcripts(page: str) -> list[list[str]]:
    return [block.splitlines() for block in TRANSCRIPT.findall(PAGES[page].read_text())]


CASES = [
    pytest.param(page, index, marks=[pytest.mark.slow] if ".zh" in page else [])  # the same commands
    for page in PAGES
    for index in range(len(transcripts(page)))
]


def alike(reported: str, got: str) -> bool:
    """True for the same words, and numbers near each other: wheels slip, odometry drifts. ``…``: and so on."""
    if reported.endswith(" …"):
        reported = reported.removesuffix(" …")
        got = " ".join(got.split()[: len(reported.split())])
    if NUMBER.sub("#", reported) != NUMBER.sub("#", got):
        return False
    pairs = zip(NUMBER.findall(reported), NUMBER.findall(got), strict=True)
    return all(
        float(b) == pytest.approx(float(a), abs=0.06 if "." in a else 3 * (float(a) > 20), rel=0.05 * ("." in a))
        for a, b in pairs
    )


def _slack(number: str) -> dict[str, float]:
    """Measured numbers have decimals, or are wheels' rpm; all others are exact."""
    if "." in number:
        return {"abs": 0.06, "rel": 0.05}
    return {"abs": 3 if 20 < int(number) < 90 else 0, "rel": 0}


@pytest.mark.parametrize(("page", "index"), CASES)
@pytest.mark.world("playground", body="robomaster_ep")
async def test_the_transcripts_are_true(
    page: str, index: int, connect, listen, pushes, broadcasts, robot, world, forward
) -> None:
    client, events = await connect(), await listen("events")
    here = world.truth.pose_of("a")
    causes: dict[str, Callable[[], object]] = {
        "time": lambda: None,
        "hand": lambda: world.stage.touch_plate("a", PlatePlace.REAR),
        "claps": lambda: world.stage.make_sound(claps(2), Point(here.x + 1, here.y)),
        "volts": lambda: world.stage.apply_voltage("a", 3, 2, 2.5),
        "place": lambda: world.stage.place("a", Pose(4.5, 3.4, 0.0)),
        "keys": lambda: (robot[InputDevice].click(MouseButton.LEFT), robot[InputDevice].press("w")),
    }

    async def ask(text: str) -> str:
        client.send(text)
        answer = asyncio.ensure_future(client.reply())
        for _ in range(1000):
            await settle()
            if answer.done():
                break
            await forward(seconds=0.05)
        return await answer

    async def reported_meanwhile(cause: str, seconds: float) -> list[str]:
        pushes.drain()
        broadcasts.drain()
        causes[cause]()
        await forward(seconds=seconds)
        await settle()
        said = re.findall(r"[^;]+;", bytes(events._buffer).decode())
        events._buffer.clear()
        return [*said, *pushes.texts(), *(text.replace(ADDRESS, "127.0.0.1") for text in broadcasts.texts())]

    wrong: list[tuple[str, ...]] = []
    reported: list[str] = []
    answer = ""
    for line in transcripts(page)[index]:
        kind, _, text = line.partition(" ")
        match kind:
            case ">":
                answer = await ask(text)
            case "<":
                wrong += [] if alike(text, answer) else [(line, answer)]
            case "#":
                waited = re.match(r"(\d+) (?:s later|秒后)", text)
                assert waited or text in CAUSES, text
                reported = await reported_meanwhile(CAUSES.get(text, "time"), float(waited[1]) if waited else 3)
            case "*":
                wrong += [] if any(alike(text, each) for each in reported) else [(line, *sorted(reported)[:9])]
            case _:
                raise AssertionError(line)
    assert not wrong


@pytest.mark.parametrize("page", PAGES)
def test_every_command_and_message_is_there(page: str) -> None:
    lines = [line for block in transcripts(page) for line in block]
    asked = [line[2:].removesuffix(";") for line in lines if line.startswith("> ")]
    reported = [line[2:].replace("game msg push", "game_msg push") for line in lines if line.startswith("* ")]
    for row in contract("robomaster"):
        if row.key.startswith("> "):
            assert any(each.startswith(row.key[2:]) for each in reported), row.key
        else:
            words, query = row.key.removesuffix(" ?"), row.key.endswith("?") and "pulse_period" not in row.key
            assert any(each.startswith(words) and each.endswith("?") == query for each in asked), row.key
    known = {operation.key.removesuffix(" ?") for operation in TABLE}
    assert known <= {known_ for known_ in known for each in asked if each.startswith(known_)}, "undocumented ones too"
