"""``roboglot coverage``: rows done of each protocol, computed from the code against the contract files."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from roboglot.programs.functions.prelude import implemented as visual
from roboglot.protocols.cyberdog.table import implemented as cyberdog
from roboglot.protocols.robomaster.server import implemented as robomaster
from roboglot.protocols.slamware.server import implemented as slamware
from roboglot.wire.contracts import PROTOCOLS, Row, contract

IMPLEMENTED = {"slamware": slamware, "robomaster": robomaster, "cyberdog": cyberdog, "visual": visual}


@dataclass(frozen=True, slots=True)
class Coverage:
    """One protocol: every row of its contract, and which are wholly there."""

    rows: tuple[Row, ...]
    done: frozenset[str]

    @property
    def missing(self) -> list[str]:
        """Keys of what is not there, or only in part."""
        return [row.key for row in self.rows if row.key not in self.done]


def measure(protocol: str) -> Coverage:
    """Compare the code's tables with the contract; a key that the contract lacks is a mistake in the code."""
    rows = contract(protocol)
    implemented = IMPLEMENTED[protocol]()
    if strangers := implemented - {row.key for row in rows}:
        raise ValueError(f"{protocol}: not in the contract: {sorted(strangers)}")
    return Coverage(rows, frozenset(implemented))


def command(
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    write: Annotated[bool, typer.Option("--write", help="Write docs/coverage.md.")] = False,
) -> None:
    """How much of each protocol is there."""
    measured = {protocol: measure(protocol) for protocol in PROTOCOLS}
    if write:
        Path("docs/coverage.md").write_text(page(measured), encoding="utf-8")
    if as_json:
        print(
            json.dumps(
                {
                    name: {"done": len(c.done), "total": len(c.rows), "missing": c.missing}
                    for name, c in measured.items()
                }
            )
        )
        return
    for name, coverage in measured.items():
        print(f"{name:12} {len(coverage.done):4} of {len(coverage.rows)}")


def page(measured: dict[str, Coverage]) -> str:
    """The coverage page."""
    lines = [
        "# Coverage",
        "",
        "Made by `roboglot coverage --write` from the code's own tables; do not edit. A row counts when the operation",
        "does all that its manual says; whatever else answers the protocol's own error.",
    ]
    for name, coverage in measured.items():
        lines += [
            "",
            f"## {name}: {len(coverage.done)} of {len(coverage.rows)}",
            "",
            "| chapter | done | missing |",
            "|---|---|---|",
        ]
        totals = Counter(row.chapter for row in coverage.rows)
        for chapter, total in totals.items():
            missing = [row.key for row in coverage.rows if row.chapter == chapter and row.key not in coverage.done]
            keys = ", ".join(f"`{key}`" for key in missing)
            lines.append(f"| {chapter} | {total - len(missing)}/{total} | {keys} |")
    return "\n".join(lines) + "\n"
