"""Gathers the pages of the site in build/pages: docs/, the README as its start, and the project's own files.

Links between them are made to fit; links to files of the clone that are not pages become plain text.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parent.parent
PAGES = ROOT / "build/pages"
MOVED = {
    "README.md": "index.md",
    "README.zh.md": "index.zh.md",
    "CONTRIBUTING.md": "project/CONTRIBUTING.md",
    "SECURITY.md": "project/SECURITY.md",
    "CHANGELOG.md": "project/CHANGELOG.md",
}
# Modules that users import, and their audience; mkdocstrings makes a page of each from the docstrings.
INTERFACES = {
    "roboglot.testing": "For tests in Python of whatever drives robots.",
    "roboglot.clients.slamware": "For programs that drive a Slamtec base.",
    "roboglot.clients.robomaster.client": "For programs that drive a RoboMaster.",
    "roboglot.clients.cyberdog": "For programs that drive a CyberDog 2.",
    "roboglot.clients.visual": "For programs that send block programs to a robot.",
    "roboglot.clients.errors": "For all who use the clients: what goes wrong, and why.",
    "roboglot.model.robot": "For authors of components, doors and drivers: what a robot is.",
    "roboglot.model.actions": "For authors of components, doors and drivers: what takes time.",
    "roboglot.model.clock": "For authors of components, doors and drivers: robot time.",
    "roboglot.model.geometry": "For computing with points, poses and twists.",
    "roboglot.model.stage": "For placing robots, people and things, and breaking them.",
    "roboglot.model.components.motion.navigation": "For sending robots somewhere.",
    "roboglot.model.components.motion.driving": "For moving robots.",
    "roboglot.model.components.mapping.localization": "For finding out where a robot is.",
    "roboglot.protocols.door": "For adding a door.",
}
CHINESE = ".zh.md"
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)|(!)\[([^\]]*)\]\(([^)\s]+)\)")


def place(source: str) -> str | None:
    """Address of the clone's file on the site; None if it is not there."""
    if source.startswith("docs/"):
        return source.removeprefix("docs/")
    return MOVED.get(source)


def rewritten(text: str, source: str) -> str:
    """Return the page's text with links that fit its new place."""
    here = place(source)
    assert here is not None
    chinese = source.endswith(CHINESE)
    twin = source.removesuffix(CHINESE) + ".md" if chinese else source.removesuffix(".md") + CHINESE

    def link(found: re.Match[str]) -> str:
        words, target = (found[1], found[2]) if found[2] else (found[4], found[5])
        mark = "!" if found[3] else ""
        if re.match(r"[a-z]+:|#", target):
            return found[0]
        path, _, anchor = target.partition("#")
        file = os.path.normpath(PurePosixPath(source).parent / path)
        new = place(file) if (ROOT / file).is_file() else None
        if new is None:
            return words
        if file == twin or (not chinese and new.endswith(CHINESE)):  # the site's own switch leads to the other language
            if not anchor and not chinese:
                return words
            up = "../" * (here.count("/") + 1)  # out of the Chinese pages' folder
            return f'<a href="{up}{new.removesuffix(".md")}.html{"#" + anchor if anchor else ""}">{words}</a>'
        relative = os.path.relpath(new.replace(CHINESE, ".md"), PurePosixPath(here).parent)
        return f"{mark}[{words}]({relative}{'#' + anchor if anchor else ''})"

    # The site has a switch of its own: a line that is nothing but a link to the other language would be a lone word.
    alone = re.escape(os.path.relpath(twin, PurePosixPath(source).parent))
    text = re.sub(rf"^\[[^\]]+\]\({alone}\)\n+", "", text, flags=re.MULTILINE)
    parts = re.split(r"(^```.*?^```[ \t]*$)", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if part.startswith("```") else LINK.sub(link, part) for part in parts)


def headings(text: str) -> list[str]:
    """Return the headings below the title, with their marks."""
    prose = re.sub(r"^```.*?^```[ \t]*$", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"^#{2,} .*$", prose, re.MULTILINE)


def slug(heading: str) -> str:
    """Return the anchor of a heading, as GitHub and ``toc`` in mkdocs.yml make it."""
    return re.sub(r"[^\w\- ]", "", heading.lstrip("# ").lower()).replace(" ", "-")


def with_english_anchors(chinese: str, english: str) -> str:
    """Return a Chinese page to which links with English anchors lead.

    Pages without a Chinese one are built among the Chinese pages, too, and link to their English headings. Where the
    two pages have not the same headings, such links lead to the page's title.
    """
    ours, theirs = headings(chinese), headings(english)
    anchors = [f'<a id="{slug(heading)}"></a>' for heading in theirs if slug(heading) not in map(slug, ours)]
    if [len(one.split()[0]) for one in ours] != [len(one.split()[0]) for one in theirs]:
        title, _, rest = chinese.partition("\n")
        return f"{title}\n\n{''.join(anchors)}\n{rest}"
    for our, their in zip(ours, theirs, strict=True):
        if slug(our) != slug(their):
            chinese = chinese.replace(f"\n{our}\n", f'\n<a id="{slug(their)}"></a>\n\n{our}\n', 1)
    return chinese


def gather() -> int:
    """Write all pages; how many there are."""
    shutil.rmtree(PAGES, ignore_errors=True)
    sources = [str(file.relative_to(ROOT)) for file in sorted((ROOT / "docs").rglob("*")) if file.is_file()]
    sources += [name for name in MOVED if (ROOT / name).exists()]
    for source in sources:
        new = PAGES / str(place(source))
        new.parent.mkdir(parents=True, exist_ok=True)
        if source.endswith(".md"):
            text = rewritten((ROOT / source).read_text("utf-8"), source)
            if source.endswith(CHINESE):
                text = with_english_anchors(text, (ROOT / (source.removesuffix(CHINESE) + ".md")).read_text("utf-8"))
            new.write_text(text, "utf-8")
        else:
            shutil.copy(ROOT / source, new)
    for module, reader in INTERFACES.items():
        new = PAGES / f"reference/api/{module}.md"
        new.parent.mkdir(parents=True, exist_ok=True)
        new.write_text(f"# {module}\n\n{reader}\n\n::: {module}\n", "utf-8")
    return len(sources) + len(INTERFACES)


if __name__ == "__main__":
    print(f"{gather()} files in {PAGES}")
