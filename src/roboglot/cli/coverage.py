"""``roboglot coverage``: implemented rows of each protocol, computed from code and contract files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from roboglot.protocols import DOORS
from roboglot.protocols.door import Contract
from roboglot.values import dataclass
from roboglot.wire.contracts import Row

CONTRACTS = {contract.name: contract for door in DOORS for contract in door.contracts}


@dataclass(frozen=True, slots=True)
class Coverage:
    """One protocol: all rows of its contract, the complete ones, and the partial ones with their missing parts."""

    rows: tuple[Row, ...]
    done: frozenset[str]
    partly: dict[str, str]
    notes: tuple[str, ...] = ()

    @property
    def missing(self) -> list[str]:
        """Keys of missing and partial rows."""
        return [row.key for row in self.rows if row.key not in self.done]


def measure(contract: Contract) -> Coverage:
    """Compare the code with the contract. Raises ValueError for a key that the contract lacks."""
    rows, implementation = tuple(contract.rows()), contract.implementation()
    keys = {row.key for row in rows}
    done = implementation.implemented()
    if strangers := done - keys:
        raise ValueError(f"{contract.name}: not in the contract: {sorted(strangers)}")
    partly = {key: why for key, why in implementation.partly().items() if key in keys}
    return Coverage(rows, frozenset(done), partly, tuple(contract.notes()))


def command(
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    write: Annotated[bool, typer.Option("--write", help="Write docs/coverage.md.")] = False,
) -> None:
    """Show how much of each protocol is there."""
    measured = {name: measure(contract) for name, contract in CONTRACTS.items()}
    if write:
        Path("docs/coverage.md").write_text(page(measured), encoding="utf-8")
    if as_json:
        print(json.dumps({name: _numbers(coverage) for name, coverage in measured.items()}))
        return
    for name, coverage in measured.items():
        print(f"{name:13} {len(coverage.done):4} of {len(coverage.rows)}, {len(coverage.partly)} more in part")


def _numbers(coverage: Coverage) -> dict[str, object]:
    return {"done": len(coverage.done), "total": len(coverage.rows), "missing": coverage.missing}


def page(measured: dict[str, Coverage]) -> str:
    """Return the coverage page."""
    lines = [
        "# Coverage",
        "",
        "For anyone who wants to know whether an operation is there.",
        "",
        "Made by `roboglot coverage --write` from the code's own tables; do not edit. A row counts when the operation",
        "does all that its manual says. What works in part says what it cannot do; everything else answers the",
        "protocol's own error.",
    ]
    for name, coverage in measured.items():
        lines += ["", f"## {name}: {len(coverage.done)} of {len(coverage.rows)}", ""]
        lines += ["| chapter | whole | missing |", "|---|---|---|"]
        for chapter in dict.fromkeys(row.chapter for row in coverage.rows):
            keys = [row.key for row in coverage.rows if row.chapter == chapter]
            missing = [key for key in keys if key not in coverage.done]
            listed = ", ".join(f"`{key}`" for key in missing if key not in coverage.partly)
            lines.append(f"| {chapter} | {len(keys) - len(missing)}/{len(keys)} | {listed} |")
        if coverage.partly:
            lines += ["", "In part:", ""]
            lines += [f"- `{key}`: {why}" for key, why in coverage.partly.items()]
        for note in coverage.notes:
            lines += ["", note]
    return "\n".join(lines) + "\n"
