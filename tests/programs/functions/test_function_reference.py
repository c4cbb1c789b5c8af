"""The reference on the disk is the one that the declarations make."""

from __future__ import annotations

from pathlib import Path

from roboglot.wire.contracts import contract
from tests.programs.functions.reference import page

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "programs.md"


def test_the_reference_is_current_and_whole() -> None:
    text = page()
    assert PAGE.read_text("utf-8") == text
    missing = [row.key for row in contract("visual") if f"**`{row.key}(" not in text and f"**`{row.key}`" not in text]
    assert missing == []
