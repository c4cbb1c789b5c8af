"""The reference of the Slamware API: each operation with an example, and the example is answered like that today."""

import importlib.util
import re
from pathlib import Path

import pytest

from roboglot.protocols.slamware.server import SlamwareDoor  # noqa: F401 - it fills the table
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.contracts import contract

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/reference/slamware.md").read_text("utf-8")
CHANCE = re.compile(r"[0-9a-f]{8}-[0-9a-f-]{27}|[0-9a-f]{32}|127[.0-9]+|-?\d[\d.e-]*")  # ids, addresses, numbers


def form(page: str) -> list[str]:
    """Words of a page, wrapped anyhow, without what differs each time or by how a machine rounds."""
    text = re.sub(r"^\d{3}$", lambda status: f"status-{int(status[0]) // 100}xx", page, flags=re.MULTILINE)
    return CHANCE.sub("#", text).split()


def test_every_operation_was_answered_in_its_example() -> None:
    for row in contract("slamware"):
        block = PAGE.partition(f"### `{row.key}`\n")[2].partition("```http")[2].partition("```")[0]
        assert re.search(r"^20[04]$", block, re.MULTILINE), row.key


def test_every_operation_is_described_as_in_the_code() -> None:
    for row in contract("slamware"):
        text = PAGE.partition(f"### `{row.key}`\n")[2].partition("```http")[0]
        summary = operation.summary if (operation := TABLE.get(row.key)) else ""
        assert " ".join(text.split()).startswith(summary.replace("``", "`")), f"{row.key}: run scripts/operations.py"


@pytest.mark.slow  # the whole tour of 167 operations; tests/protocols/slamware has each
def test_the_example_is_answered_as_the_reference_says() -> None:
    spec = importlib.util.spec_from_file_location("operations", ROOT / "scripts/operations.py")
    assert spec is not None
    assert spec.loader is not None
    operations = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(operations)
    assert form(operations.page(operations.played())) == form(PAGE), "run scripts/operations.py"
