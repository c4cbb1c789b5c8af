"""The doors' first calls in every language of their pages, as they are printed there, against a robot that moves."""

from __future__ import annotations

import re
import shlex
import shutil
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from roboglot.model.geometry import Pose
from roboglot.testing.addresses import free_addresses
from tests.docs.docs_terminal import ROOT, Terminal, terminal
from tests.docs.test_docs import blocks

RUN = {
    "sh": "bash first.sh",
    "python": f"{shlex.quote(sys.executable)} first.py",
    "js": "node --experimental-websocket first.mjs",
    "go": "GOFLAGS=-mod=mod GO111MODULE=off go run first.go",
}
SUFFIX = {"sh": "sh", "python": "py", "js": "mjs", "go": "go"}
NEEDS = {"sh": "curl", "python": sys.executable, "js": "node", "go": "go"}
# Go's compiler is slow.
LANGUAGES = pytest.mark.parametrize(
    "languages", [["sh", "python", "js"], pytest.param(["go"], marks=pytest.mark.slow)], ids=" ".join
)


def first_call(page: str, language: str) -> str:
    """Return the code below the heading "First call"."""
    text = (ROOT / "docs/protocols" / page).read_text()
    [section] = re.findall(r"^## First call.*?(?=^## )", text, re.MULTILINE | re.DOTALL)
    found = re.findall(rf"^```{language}\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    return "\n".join(found)


@pytest.fixture
async def user(tmp_path: Path) -> AsyncIterator[Terminal]:
    async with terminal(tmp_path, free_addresses(1)) as opened:
        assert (await opened.type(".venv/bin/roboglot certs --export phone")).status == 0
        yield opened


async def said_by(user: Terminal, page: str, language: str) -> str:
    """Run the page's code and return what it printed."""
    if shutil.which(NEEDS[language]) is None:
        pytest.skip(f"needs {NEEDS[language]}")
    code = first_call(page, language)
    assert code, f"{page} has no first call in {language}"
    (user.folder / f"first.{SUFFIX[language]}").write_text(code.replace("127.0.0.1", user.address))
    ended = await user.type(f"ANSWERS=3; {RUN[language]}")
    assert ended.status == 0, ended.said
    return ended.said


@LANGUAGES
async def test_slamware(user: Terminal, languages: list[str]) -> None:
    for language in languages:
        said = await said_by(user, "slamware.md", language)
        assert re.search(r"\bx\W{1,3}(0\.9|1\.0)", said), said
        assert user.moved.distance_to(Pose(1.0, 0.5)) < 0.15


@LANGUAGES
async def test_robomaster(user: Terminal, languages: list[str]) -> None:
    for language in languages:
        before = user.moved
        said = await said_by(user, "robomaster.md", language)
        assert len(re.findall("ok", said)) == 2, said
        assert user.moved.distance_to(before) == pytest.approx(0.5, abs=0.08)


@LANGUAGES
async def test_cyberdog(user: Terminal, languages: list[str]) -> None:
    for language in languages:
        assert '{"' in await said_by(user, "cyberdog.md", language)


async def test_visual(user: Terminal) -> None:
    for language in ("sh", "python", "js"):
        assert "hello" in await said_by(user, "visual.md", language)


@pytest.mark.parametrize("name", ["slamware", "robomaster", "cyberdog", "visual", "vda5050", "foxglove"])
def test_every_door_says_why_it_refuses(name: str) -> None:
    page = ROOT / f"docs/protocols/{name}.md"
    text = page.read_text()
    assert "## Why was I refused" in text
    assert list(blocks(page, "sh", ""))
