"""A hook of mkdocs that divides the Chinese of the search index into words, so that they are found within sentences.

Chinese has no spaces: undivided, each sentence is one word to the search and found by its beginning alone. Words are
those of the project: docs/reference/terms.md, and what the console's and the studio's pages say in short. Other text is
divided into characters.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from pathlib import Path

from mkdocs.plugins import event_priority

ROOT = Path(__file__).resolve().parent.parent
GAP = "\u200b"  # has no width; a separator of the search in mkdocs.yml
LONGEST = 5  # characters of a word
HAN = re.compile(r"[\u4e00-\u9fff]+")
WORD = re.compile(rf"[\u4e00-\u9fff]{{2,{LONGEST}}}")


def words() -> AbstractSet[str]:
    """Return the project's own Chinese words."""
    terms = (ROOT / "docs/reference/terms.md").read_text("utf-8")
    rows = re.findall(r"^\| [^|]+ \| ([^|]+) \|", terms, re.MULTILINE)
    found = {word for row in rows for word in row.split("、") if WORD.fullmatch(word)}
    for file in (ROOT / "src/roboglot/console/web").rglob("words/*zh.json"):
        found.update(filter(WORD.fullmatch, json.loads(file.read_text("utf-8")).values()))
    return found


def divided(text: str, known: AbstractSet[str]) -> str:
    """Return a text with gaps between its Chinese words, the longest known ones from the left."""

    def parts(run: str) -> list[str]:
        found = []
        while run:
            size = next((n for n in range(min(LONGEST, len(run)), 1, -1) if run[:n] in known), 1)
            found.append(run[:size])
            run = run[size:]
        return found

    return HAN.sub(lambda run: GAP + GAP.join(parts(run[0])) + GAP, text)


def divide_index(site: Path) -> None:
    """Divide a site's index in both of its forms: for a server, and for pages from a folder."""
    folder = site / "search"
    index, known = json.loads((folder / "search_index.json").read_text("utf-8")), words()
    for page in index["docs"]:
        page["title"], page["text"] = divided(page["title"], known), divided(page["text"], known)
    text = json.dumps(index)
    (folder / "search_index.json").write_text(text, "utf-8")
    (folder / "search_index.js").write_text(f"var __index = {text}", "utf-8")


@event_priority(-1000)  # once the other languages are built
def on_post_build(config: Mapping[str, str]) -> None:
    """Divide the index of the site that mkdocs has made."""
    divide_index(Path(config["site_dir"]))
