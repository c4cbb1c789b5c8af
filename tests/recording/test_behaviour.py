"""Comparing how robots behave: other values agree; other fields, units, ranges, rates, times and orders do not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from roboglot.cli import loaded
from roboglot.cli.recordings.compare import compared
from roboglot.cli.recordings.read_only import askable, reads
from roboglot.config import load_config
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols import sections
from roboglot.recording.comparing.behaviour import compare_behaviour
from roboglot.recording.comparing.masks import ComparisonMode, Mask, Rule
from roboglot.recording.lines import Target
from roboglot.recording.probing import questions
from roboglot.recording.proxy.relay import ExchangeWriter
from roboglot.runtime import Runtime
from tests.recording.test_playback import ADDRESS, SECOND

POSE = "GET /api/core/slam/v1/localization/pose"


def session(scale: float = 1.0, offset: float = 0.0, period: float = 0.2, seconds: float = 0.05) -> list[Exchange]:
    """Polls of a pose and pushes, of a robot that drives."""
    found: list[Exchange] = []
    rest = ("a", "slamware", "127.0.0.1:1", "c")
    for n in range(10):
        at = float(n)
        body = {"x": scale * (1.0 + 0.1 * n) + offset, "y": 0.5, "ok": True, "items": [{"id": n}] if n % 2 else []}
        found.append(Exchange(at, *rest, Direction.REQUEST, POSE, f"{POSE}\n\n".encode()))
        reply = json.dumps(body).encode()
        found.append(Exchange(at + seconds, *rest, Direction.REPLY, POSE, reply, "200", "", seconds))
        found.append(Exchange(5.0 + n * period, *rest, Direction.PUSH, "> push", f"push {n} 0.5".encode()))
    return sorted(found, key=lambda exchange: exchange.stamp)


def replies(change: Callable[[dict[str, Any]], object]) -> list[Exchange]:
    """Return the session with its answers changed."""
    found = []
    for exchange in session():
        if exchange.direction is Direction.REPLY:
            value = json.loads(exchange.payload)
            change(value)
            exchange = exchange._replace(payload=json.dumps(value).encode())
        found.append(exchange)
    return found


def complaints(other: list[Exchange], mask: Mask | None = None) -> list[str]:
    comparison = compare_behaviour(session(), other, mask)
    return [difference.what for row in comparison.rows for difference in row.differences]


def test_another_place_is_no_difference() -> None:
    assert complaints(session()) == []
    assert complaints(session(scale=1.1, offset=0.3)) == []


@pytest.mark.parametrize(
    ("other", "what"),
    [
        (session(scale=1000.0), "$.x (magnitude)"),
        (session(offset=4.0), "$.x (range)"),
        (session(period=0.4), "pushes a second"),
        (session(seconds=0.9), "seconds to the answer (median)"),
        (replies(lambda value: value.pop("y")), "$.y"),
        (replies(lambda value: value.update(z=1)), "$.z"),
        (replies(lambda value: value.update(ok="yes")), "$.ok (type)"),
        ([e._replace(status="500") if e.status else e for e in session()], "statuses"),
        ([e for e in session() if e.direction is not Direction.PUSH], "operation"),
    ],
)
def test_differences_are_named(other: list[Exchange], what: str) -> None:
    assert what in complaints(other)


def test_empty_lists_say_nothing_of_their_elements() -> None:
    assert complaints(replies(lambda value: value.update(items=[]))) == []


def test_the_order_of_first_occurrence_counts() -> None:
    early = [e._replace(stamp=e.stamp - 9.0) if e.direction is Direction.PUSH else e for e in session()]
    assert complaints(sorted(early, key=lambda exchange: exchange.stamp)) == ["order"]


def test_masks_count_here_too() -> None:
    other = replies(lambda value: value.pop("y"))
    assert complaints(other, Mask((Rule(ComparisonMode.IGNORED, field="$.y"),))) == []
    assert complaints(session(offset=4.0), Mask((Rule(ComparisonMode.SHAPE, field="$.x"),))) == []


@pytest.mark.parametrize("door", ["slamware", "robomaster", "cyberdog", "visual"])
def test_probes_ask_only_what_reads(door: str) -> None:
    asked = askable(door)
    assert len(asked) >= 5
    assert set(asked) <= reads(door)
    found = questions(door, asked, rounds=2)
    assert {exchange.operation for exchange in found} >= set(asked)
    assert len(found) >= 4 * len(asked)


def test_absent_robots_and_differing_protocols_are_refused() -> None:
    runner, app = CliRunner(), loaded("compare")
    for door in ("slamware", "robomaster", "cyberdog", "visual"):  # two silent robots must not agree
        gone = runner.invoke(app, [f"{door}://127.0.193.99:9", f"{door}://127.0.193.99:9"])
        assert (door, gone.exit_code, "fidelity" in gone.output) == (door, 2, False)
    mixed = runner.invoke(app, ["robomaster://127.0.0.1", "slamware://127.0.0.1"])
    assert (mixed.exit_code, "one protocol" in mixed.output) == (2, True)
    missing = runner.invoke(app, [str(Path("no.mcap")), "slamware://127.0.0.1"])
    assert missing.exit_code == 2


@pytest.mark.slow
async def test_robots_are_compared_by_their_urls(tmp_path: Path) -> None:
    values = {
        "data": str(tmp_path / "data"),
        "world": "empty",
        "lockstep": True,
        "robots": [
            {"name": "a", "body": "universal", "address": ADDRESS},
            {"name": "b", "body": "hermes", "address": SECOND},
        ],
        "console": {"enabled": False},
    }
    runtime = Runtime(load_config(None, values, sections()))
    await runtime.start()
    try:
        for door in ("slamware", "robomaster", "visual", "cyberdog"):
            proof = f"?certs={tmp_path}/data/cyberdog/tls" if door == "cyberdog" else ""
            urls = f"{door}://{ADDRESS}{proof}", f"{door}://{ADDRESS}{proof}"
            same = await compared(urls, None, "", "", Mask(), commands=False)
            assert [row.differences for row in same.rows if row.differences] == []
            assert sum(row.checks for row in same.rows) > 20
        other = await compared((f"slamware://{ADDRESS}", f"slamware://{SECOND}"), None, "", "", Mask(), commands=False)
        assert 0.5 < other.fidelity < 1.0
    finally:
        await runtime.close()


def test_recordings_of_commands_alone_are_not_compared(tmp_path: Path) -> None:
    file = tmp_path / "drive.mcap"
    writer = ExchangeWriter(file, Target("slamware://127.0.0.1"), "0")
    drive = "POST /api/core/motion/v1/actions"
    writer.note("127.0.0.1:5", Direction.REQUEST, drive, f"{drive}\n\n{{}}".encode(), "", None)
    writer.note("127.0.0.1:5", Direction.REPLY, drive, b"{}", "200", None)
    writer.close()
    found = CliRunner().invoke(loaded("compare"), [str(file), "slamware://127.0.193.99:9"])
    assert (found.exit_code, "--commands" in found.output) == (2, True)
