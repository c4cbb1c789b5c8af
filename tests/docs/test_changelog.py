"""The changelog's Unreleased section: for users of the last release, so short that they read it."""

from __future__ import annotations

import re

from tests.docs.docs_terminal import ROOT

LINES_MAX = 230  # fixes of what is itself new get no line, see CONTRIBUTING.md


def test_unreleased_is_short_and_its_groups_come_once() -> None:
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    found = re.search(r"^## \[Unreleased\]\n(.*?)^## \[", text, re.MULTILINE | re.DOTALL)
    assert found is not None
    lines = found[1].splitlines()
    groups = [line for line in lines if line.startswith("### ")]
    assert len(groups) == len(set(groups)), groups
    assert len(lines) <= LINES_MAX, "merge by hand: an older version's lines may have come back"
