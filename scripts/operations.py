"""Writes docs/reference/slamware.md: every operation of the API with an example that ran.

examples/operations/slamware.py asks a simulated robot in lockstep; what is written is what went through its door.
"""

from __future__ import annotations

import importlib.util
import json
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from roboglot.model.components.logistics.industry import CallKind, Industry
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.slamware.table import TABLE
from roboglot.testing.server import RobotServer, serving
from roboglot.wire.contracts import contract

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "examples/operations/slamware.py"
PAGE = ROOT / "docs/reference/slamware.md"
WIDTH = 116
ITEMS_MAX = 2  # entries of a list
TEXT_MAX = 60  # characters of a text
HEAD = """# Operations of the Slamware API

For integrators who look an operation up. After this page you have a request that works for each of them.

`scripts/operations.py` made it: it played `examples/operations/slamware.py` on a simulated `hermes` in the world
`office`, one request after the other, and recorded requests and answers. Long lists and texts are cut (`…`),
numbers are rounded. All parameters are in the robot's own `http://127.0.0.1:1448/openapi.json`; why it
refuses is in [Slamware REST](../protocols/slamware.md#why-was-i-refused).
"""

Pair = tuple[Exchange, Exchange]


class Stage:
    """Events around the robot in the example."""

    def __init__(self, server: RobotServer) -> None:
        self._server = server

    def wait(self, seconds: float) -> None:
        """Let robot time pass."""
        self._server.forward(seconds=seconds)

    def break_lidar(self) -> None:
        """Take the scans away."""
        self._server.stage.inject_fault("lidar_gone")

    def mend(self) -> None:
        """Give them back."""
        self._server.stage.clear_fault()

    def press_call_button(self, place: str) -> None:
        """Call the robot to a place."""
        self._server.loop.run(self._server.robot[Industry].call, CallKind.PLAIN, place)


def example() -> ModuleType:
    """The example, which is not a package."""
    spec = importlib.util.spec_from_file_location("slamware_operations", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def played() -> dict[str, Pair]:
    """The first request and answer of each operation, by its key."""
    pairs: dict[str, Pair] = {}
    asked: list[Exchange] = []

    def note(exchange: Exchange) -> None:
        if exchange.door == "slamware" and exchange.direction is Direction.REQUEST:
            asked[:] = [exchange]
        elif exchange.door == "slamware" and asked:
            pairs.setdefault(exchange.operation, (asked.pop(), exchange))

    with serving(world="office", body="hermes", lockstep=True) as server:
        server.call(server.robot.tap.listen, note)
        example().play(server.address, Stage(server))
    return pairs


def page(pairs: dict[str, Pair]) -> str:
    """The text of the page."""
    return "\n".join([HEAD, *_lines(pairs)])


def _lines(pairs: dict[str, Pair]) -> Iterator[str]:
    chapter = ""
    for row in contract("slamware"):
        if row.chapter != chapter:
            chapter = row.chapter
            yield f"## {chapter}\n"
        operation = TABLE.get(row.key)
        summary = operation.summary.replace("``", "`") if operation else ""
        partly = f" In part: {operation.partial}." if operation and operation.partial else ""
        yield f"### `{row.key}`\n"
        yield textwrap.fill(f"{summary}{partly}", WIDTH, break_long_words=False, break_on_hyphens=False) + "\n"
        request, reply = pairs[row.key]
        head, _, body = request.payload.partition(b"\n\n")
        yield "\n".join(["```http", head.decode(), *_shown(body), "", reply.status, *_shown(reply.payload), "```\n"])


def _shown(body: bytes) -> list[str]:
    """A body in lines that fit the page; how long it is where it is not text."""
    if not body:
        return []
    try:
        text = json.dumps(_short(json.loads(body)), ensure_ascii=False)
    except ValueError:
        return [f"({len(body)} bytes)"]
    return textwrap.wrap(text, WIDTH - 4, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def _short(value: Any) -> Any:
    match value:
        case dict():
            return {key: _short(part) for key, part in value.items()}
        case list():
            return [_short(part) for part in value[:ITEMS_MAX]] + ["…"] * (len(value) > ITEMS_MAX)
        case float():
            return round(value, 3)
        case str() if len(value) > TEXT_MAX:
            return value[:TEXT_MAX] + "…"
    return value


if __name__ == "__main__":
    PAGE.write_text(page(played()), "utf-8")
    print(f"wrote {PAGE}")
