"""``roboglot capabilities``: what each protocol can do on each kind of robot, computed from the code's own tables.

A robot supports an operation if it has all components that the handler declares as needed.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from roboglot.config import RobotConfig
from roboglot.drivers import DRIVERS as DRIVER_TYPES
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.component import Component
from roboglot.protocols import DOORS
from roboglot.protocols.door import DoorType
from roboglot.storage.database import Database
from roboglot.values import dataclass

BODIES = ("universal", "robomaster_ep", "cyberdog2", "hermes")
# For each driver, a URL without a robot and what the driver announces.
DRIVERS: Mapping[str, tuple[str, Mapping[type[Component], str]]] = {
    f"{kind.scheme}://": (f"{kind.scheme}://127.0.0.1:9" + f"?{kind.example}" * bool(kind.example), kind.announced())
    for kind in DRIVER_TYPES
}
PAGE = Path("docs/capabilities.md")


@dataclass(frozen=True, slots=True)
class RobotKind:
    """A kind of robot: its components, and plain descriptions of the approximate ones."""

    name: str
    components: frozenset[type[Component]]
    nearly: Mapping[type[Component], str]

    def judge(self, needed: frozenset[type[Component]]) -> str:
        """Return ``exact``, ``nearly`` or ``refused`` for operations that need these components."""
        if needed - self.components:
            return "refused"
        return "nearly" if any(self.nearly.get(interface) for interface in needed) else "exact"


def command(write: Annotated[bool, typer.Option("--write", help="Write docs/capabilities.md.")] = False) -> None:
    """Show what each protocol can do on each kind of robot."""
    text = page(_show_progress)
    if write:
        PAGE.write_text(text, encoding="utf-8")
    else:
        print(text, end="")


def _show_progress(done: int, name: str) -> None:
    """Show progress on a terminal, as building each kind of robot takes seconds."""
    if sys.stderr.isatty():
        total = len(BODIES) + len(DRIVERS)
        words = f"{done} of {total} kinds of robots; building {name} …" if name else ""
        print(f"\r\x1b[K{words}", end="", file=sys.stderr, flush=True)


def kinds(report: Callable[[int, str], None] = lambda _done, _name: None) -> list[RobotKind]:
    """Return simulated bodies, as in the office world, and drivers' robots, each with our skills and memory.

    ``report`` is called with the number done and the name of the next one, "" at the end.
    """
    return asyncio.run(_kinds(report))


async def _kinds(report: Callable[[int, str], None]) -> list[RobotKind]:
    made: list[RobotKind] = []
    for name in (*BODIES, *DRIVERS):
        report(len(made), name)
        url, announced = DRIVERS.get(name, (name, {}))
        database = Database(":memory:")
        fleet = build_fleet("office", [RobotConfig("a", url)], clock=LockstepClock(), seed=1, database=database)
        made.append(RobotKind(name, frozenset(fleet.robots["a"].interfaces) | announced.keys(), announced))
        await fleet.close()
        database.close()
    report(len(made), "")
    return made


def page(report: Callable[[int, str], None] = lambda _done, _name: None) -> str:
    """Return the page; ``report`` as in ``kinds``."""
    columns = kinds(report)
    lines = [
        "# Capabilities",
        "",
        "For anyone who chooses a robot and a protocol: what each can do with which.",
        "",
        "Made by `roboglot capabilities --write` from the code; do not edit. Columns are simulated bodies and drivers",
        "of real robots, rows the chapters of a protocol. A cell counts the requests that such a robot has the parts",
        "for, as its handlers declare them: `12/14` is twelve of fourteen, `(5≈)` five of the twelve by a part",
        "that is only nearly the model's. The others answer the protocol's own error, and so may a request that itself",
        "asks whether a part is there: it counts as done. What real robots refuse, and for want of which part, is",
        "listed below each table. What a protocol lacks on every robot is on [the coverage page](coverage.md).",
    ]
    drivers = [kind for kind in columns if kind.name in DRIVERS]
    for door in DOORS:
        lines += ["", f"## {door.name}", "", _head("chapter", columns), _rule(columns)]
        lines += _chapters(door, columns)
        lines += ["", f"### What {door.name} is refused on real robots", ""]
        lines += [_head("requests", drivers), _rule(drivers), *_refusals(door, drivers)]
    lines += [
        "",
        "## Components",
        "",
        "● has it, ≈ nearly (see below).",
        "",
        _head("component", columns),
        _rule(columns),
    ]
    every = sorted({c for kind in columns for c in kind.components}, key=lambda c: c.__name__)
    lines += [_row(c.__name__, [_mark(kind, c) for kind in columns]) for c in every]
    for name, (_, announced) in DRIVERS.items():
        lines += ["", f"## What `{name}` does nearly", ""]
        lines += [f"- {c.__name__}: {words}" for c, words in announced.items() if words]
    return "\n".join(lines) + "\n"


def _chapters(door: DoorType, columns: list[RobotKind]) -> list[str]:
    needs, rows = {str(op.key): op.needs for op in door.table()}, door.contracts[0].rows()
    lines = []
    for chapter in dict.fromkeys(row.chapter for row in rows):
        found = [needs[row.key] for row in rows if row.chapter == chapter and row.key in needs]
        if found:
            lines.append(_row(chapter, [_cell([kind.judge(needed) for needed in found]) for kind in columns]))
    return lines


def _refusals(door: DoorType, drivers: list[RobotKind]) -> list[str]:
    """Return a row for each group of requests that all drivers' robots refuse for lack of the same components."""
    needs, rows = {str(op.key): op.needs for op in door.table()}, door.contracts[0].rows()
    alike: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        if row.key in needs:
            lacks = tuple(", ".join(_names(needs[row.key] - kind.components)) for kind in drivers)
            if any(lacks):
                name = row.key.removeprefix("cyberdog.") if door.name == "visual" else row.name
                alike.setdefault(lacks, []).append(f"`{name}`")
    return [_row(" ".join(names), [f"no {lack}" if lack else "" for lack in lacks]) for lacks, names in alike.items()]


def _names(components: frozenset[type[Component]]) -> list[str]:
    return sorted(component.__name__ for component in components)


def _cell(verdicts: list[str]) -> str:
    nearly, refused = verdicts.count("nearly"), verdicts.count("refused")
    return f"{len(verdicts) - refused}/{len(verdicts)}" + (f" ({nearly}≈)" if nearly else "")


def _mark(kind: RobotKind, component: type[Component]) -> str:
    if component not in kind.components:
        return ""
    return "≈" if kind.nearly.get(component) else "●"


def _head(first: str, columns: list[RobotKind]) -> str:
    return _row(first, [kind.name for kind in columns])


def _rule(columns: list[RobotKind]) -> str:
    return "|---" * (len(columns) + 1) + "|"


def _row(first: str, cells: list[str]) -> str:
    return f"| {' | '.join([first, *cells])} |"
