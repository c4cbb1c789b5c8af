"""The pages: their links lead somewhere, their paths exist, their code is code, their commands run from the clone."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md")])
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"!?\[[^]]*\]\(([^)\s]+)\)")
FOREIGN = re.compile(r"[a-z]+:|//")
PATH = re.compile(r"`([\w.-]+(?:/[\w.-]+)+\.(?:py|toml|md|json|proto|yaml|xml|sql))`")
HOMES = (ROOT, ROOT / "src", ROOT / "src/roboglot")
# Not on a newcomer's PATH: these are in .venv/bin.
BARE = re.compile(r"(?:^|[|;&(] *)(?:\$ )?(roboglot|python3?|pip|pytest|ruff|mypy)(?= )", re.MULTILINE)
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]
every_page = pytest.mark.parametrize("page", PAGES, ids=NAMES)


def blocks(page: Path, *languages: str) -> Iterator[str]:
    return (code for language, code in FENCE.findall(page.read_text()) if language in languages)


def anchors(page: Path) -> set[str]:
    """Anchors of its headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_there_are_pages() -> None:
    assert {"README.md", "docs/architecture.md", "docs/protocols/slamware.md"} <= set(NAMES)


DOORS = [page for page in PAGES if page.parent.name == "protocols" and ".zh" not in page.suffixes]


@pytest.mark.parametrize("door", DOORS, ids=lambda page: page.stem)
def test_doors_have_chinese_pages_with_the_same_programs(door: Path) -> None:
    chinese = door.with_name(f"{door.stem}.zh.md")
    assert chinese.exists(), chinese
    known = set(blocks(door, "python", "js", "go"))
    assert set(blocks(chinese, "python", "js", "go")) <= known, chinese
    assert f"({door.name})" in chinese.read_text(), "it leads to the page that is more detailed"


@every_page
def test_local_links_lead_somewhere(page: Path) -> None:
    for link in LINK.findall(FENCE.sub("", page.read_text())):
        if FOREIGN.match(link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", [page for page in PAGES if page.name.endswith(".zh.md")], ids=str)
def test_chinese_pages_link_to_chinese_pages(page: Path) -> None:
    """Only the link to the same page in English leaves the language, where there is a Chinese page."""
    for link in LINK.findall(FENCE.sub("", page.read_text())):
        target = (page.parent / link.partition("#")[0]).resolve()
        if target.suffix == ".md" and target.name != page.name.replace(".zh.md", ".md"):
            assert target.name.endswith(".zh.md") or not target.with_suffix(".zh.md").exists(), link


@every_page
def test_paths_exist(page: Path) -> None:
    for path in PATH.findall(FENCE.sub("", page.read_text())):
        if not path.startswith("path/"):
            assert any((home / path).exists() for home in (*HOMES, page.parent)), path


def test_every_extra_is_listed() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(re.findall(r"^\| `(\w+)` \|", (ROOT / "docs/install.md").read_text(), re.MULTILINE)) == set(extras)


@every_page
def test_python_is_python(page: Path) -> None:
    for code in blocks(page, "python"):
        compile(code, str(page), "exec", ast.PyCF_ONLY_AST | ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)


@every_page
def test_toml_is_toml(page: Path) -> None:
    for code in blocks(page, "toml"):
        tomllib.loads(code)


@every_page
def test_commands_run_in_the_clone(page: Path) -> None:
    for code in blocks(page, "sh", "bash", "console", ""):
        assert not BARE.search(code), BARE.search(code)
    assert "pip install '.[" not in page.read_text(), "it would cut the command off from the clone: install -e"
    for script in re.findall(r"(?:^|[\s`])((?:\.venv/bin/python )?(?:scripts|examples)/[\w./-]+)", page.read_text()):
        assert (ROOT / script.removeprefix(".venv/bin/python ")).exists(), script


@pytest.mark.slow  # tests/testing/test_fixtures.py plays the start page's
def test_examples_run_in_a_users_project(tmp_path: Path) -> None:
    """Each page's tests, in a folder with no settings of pytest at all."""
    count = 0
    for page in PAGES:
        for code in blocks(page, "python"):
            if re.search(r"^(async )?def test_", code, re.MULTILINE):
                count += 1
                (tmp_path / f"test_{page.stem.lower().replace('.', '_')}_{count}.py").write_text(code)
    assert count >= 3
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--rootdir",
        str(tmp_path),
        str(tmp_path),
    ]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=200, cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.parametrize("page", sorted(ROOT.glob("docs/**/*.md")), ids=lambda page: page.name)
def test_every_page_says_who_it_is_for(page: Path) -> None:
    assert re.search(r"^(For |写给)", "\n".join(page.read_text().splitlines()[:9]), re.MULTILINE)
