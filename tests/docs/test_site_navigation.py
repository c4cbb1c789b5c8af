"""The site's navigation; the languages are switched by the site itself."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_navigation_names_each_page_once_in_english() -> None:
    """A Chinese page named there became a link to its Markdown on every page of the site."""
    navigation = (ROOT / "mkdocs.yml").read_text("utf-8").partition("\nnav:\n")[2]
    pages = re.findall(r"[\w./]+\.md$", navigation, re.MULTILINE)
    assert len(pages) > 40
    assert [page for page in pages if page.endswith(".zh.md") or pages.count(page) > 1] == []
