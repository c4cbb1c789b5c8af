"""The site: its navigation, and the links of both languages; the languages are switched by the site itself."""

from __future__ import annotations

import importlib.util
import re
import subprocess
from pathlib import Path
from types import ModuleType

import pytest

from tests.docs.test_docs import FENCE, LINK

ROOT = Path(__file__).parents[2]
PLACED = re.compile(r'<a id="([^"]+)"></a>')
TWIN = re.compile(r'<a href="([^"]+)\.html#([^"]+)">')  # to the page in the other language


@pytest.fixture
def site() -> ModuleType:
    spec = importlib.util.spec_from_file_location("site_pages", ROOT / "scripts/site.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def pages(site: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(site, "PAGES", tmp_path)
    site.gather()
    return tmp_path


def test_navigation_names_each_page_once_in_english() -> None:
    """A Chinese page named there became a link to its Markdown on every page of the site."""
    navigation = (ROOT / "mkdocs.yml").read_text("utf-8").partition("\nnav:\n")[2]
    pages = re.findall(r"[\w./]+\.md$", navigation, re.MULTILINE)
    assert len(pages) > 40
    assert [page for page in pages if page.endswith(".zh.md") or pages.count(page) > 1] == []


def test_sections_of_the_navigation_have_chinese_names() -> None:
    settings, _, navigation = (ROOT / "mkdocs.yml").read_text("utf-8").partition("\nnav:\n")
    sections = re.findall(r"^  - (.+):$", navigation, re.MULTILINE)
    chinese = dict(re.findall(r"^            (.+): (.*[\u4e00-\u9fff].*)$", settings, re.MULTILINE))
    assert len(sections) > 5
    assert [section for section in sections if section not in chinese] == []


def test_no_line_is_left_of_links_between_languages(pages: Path) -> None:
    """The site leads to the other language itself; the links' words stood alone on top of its pages."""
    texts = {page.name: page.read_text("utf-8") for page in pages.rglob("*.md")}
    assert [name for name, text in texts.items() if re.search("^(中文|English)(（|$)", text, re.MULTILINE)] == []
    assert '<a href="../../protocols/slamware.html">English</a>（' in (pages / "protocols/slamware.zh.md").read_text(
        "utf-8"
    )


def test_links_lead_somewhere_in_both_languages(site: ModuleType, pages: Path) -> None:
    """Links from pages without a Chinese one, too: they are built among the Chinese pages."""

    def anchors(page: Path) -> set[str]:
        text = page.read_text("utf-8")
        return {site.slug(heading) for heading in site.headings(text)} | set(PLACED.findall(text))

    dead, count = [], 0
    for page in sorted(pages.rglob("*.md")):
        for target in LINK.findall(FENCE.sub("", page.read_text("utf-8"))):
            path, _, anchor = target.partition("#")
            if re.match(r"[a-z]+:", target) or (path and not path.endswith(".md")):
                continue
            count += 1
            english = page.parent / path if path else page
            chinese = english.with_suffix(".zh.md")
            if page.name.endswith(".zh.md"):
                reached = [chinese if path and chinese.exists() else english]
            else:
                reached = [english, chinese] if path and chinese.exists() else [english]
            dead += [f"{page}: {target}" for to in reached if not to.exists() or (anchor and anchor not in anchors(to))]
    assert dead == []
    assert count > 200


def test_chinese_pages_stay_linked(pages: Path) -> None:
    """Links between them were plain words on the site."""
    assert "](console.md)" in (pages / "start.zh.md").read_text("utf-8")
    assert "](protocols/slamware.md#四种语言的第一次调用)" in (pages / "start.zh.md").read_text("utf-8")
    assert "](start.md)" not in (pages / "start.zh.md").read_text("utf-8"), "the site has a switch"


def test_links_to_english_sections_leave_the_chinese_pages(site: ModuleType, pages: Path) -> None:
    found = [
        (page.relative_to(pages), *link)
        for page in pages.rglob("*.zh.md")
        for link in TWIN.findall(page.read_text("utf-8"))
    ]
    assert found
    for page, path, anchor in found:
        target = pages.parent / "site" / "zh" / page.parent / path
        english = pages / Path(*target.resolve().relative_to((pages.parent / "site").resolve()).parts)
        assert anchor in map(site.slug, site.headings(english.with_suffix(".md").read_text("utf-8"))), page


def test_search_without_a_server_has_its_script_here() -> None:
    """The plugin ``offline`` has it loaded from unpkg.com unless the settings name another."""
    found = re.search(r"^  polyfills: \[(.*?)\]", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE)
    assert found is not None
    assert [name for name in found[1].split(", ") if "iframe-worker" in name]
    assert [name for name in found[1].split(", ") if not (ROOT / "docs" / name).is_file()] == []


@pytest.mark.slow  # builds the site; in short: test_search_without_a_server_has_its_script_here
def test_site_loads_nothing_from_elsewhere(tmp_path: Path) -> None:
    build = [str(ROOT / "scripts/docs"), "--site-dir", str(tmp_path)]
    subprocess.run(build, check=True, capture_output=True, timeout=200)
    texts = {str(page.relative_to(tmp_path)): page.read_text("utf-8") for page in tmp_path.rglob("*.html")}
    assert len(texts) > 80
    loaded = re.compile(
        r"<(?:script|link|img|iframe|source|video|audio|object|embed)\b[^>]*?=[\"']?(?:https?:)?//[^>]*>"
    )
    assert {name: found for name, text in texts.items() if (found := loaded.findall(text))} == {}
