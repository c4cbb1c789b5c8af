"""The pages: both languages are whole, vendored libraries are as they were published, nothing is from outside."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import re
import tomllib
from pathlib import Path

import pytest

from roboglot.console.assets import FOLDER, Assets
from roboglot.model.components.system.lease import OUTSIDE, TAKEN
from roboglot.model.components.system.link import FAULT as LINK_LOST
from roboglot.simulation.components.system.health_monitor import WATCHES
from roboglot.simulation.faults.fault_kinds import KINDS

OWN = [path for path in FOLDER.rglob("*") if path.suffix in (".js", ".css", ".html") and "vendor" not in path.parts]
TESTS_VENDOR = Path(__file__).parent.parent / "browser" / "vendor"
WORDS = {
    name: {
        key: text
        for folder in (FOLDER, FOLDER / "studio", FOLDER / "fleet")
        for key, text in json.loads((folder / "words" / f"{name}.json").read_text("utf-8")).items()
    }
    for name in ("en", "zh")
}
_KEY = re.compile(r"""\bt\(\s*["']([\w.]+)["']""")
_COMPUTED = re.compile(r"\bt\(\s*`([\w.]*)\$\{")


def test_both_languages_say_the_same_things() -> None:
    en, zh = WORDS["en"], WORDS["zh"]
    assert set(en) == set(zh)
    assert [key for key in en if not (en[key].strip() and zh[key].strip())] == []
    names = re.compile(r"\{\w+\}")
    assert [key for key in en if sorted(names.findall(en[key])) != sorted(names.findall(zh[key]))] == []


def test_every_key_of_the_pages_has_words() -> None:
    code = "\n".join(path.read_text("utf-8") for path in OWN)
    assert sorted(set(_KEY.findall(code)) - set(WORDS["en"])) == []
    for prefix in set(_COMPUTED.findall(code)):
        assert any(key.startswith(prefix) for key in WORDS["en"]), prefix


def test_names_of_faults_have_words_in_both_languages() -> None:
    wanted = {f"robot.{name}" for name in (LINK_LOST, TAKEN, OUTSIDE, *(watch.name for watch in WATCHES))}
    assert [sorted(wanted - set(WORDS[language])) for language in ("en", "zh")] == [[], []]


def test_one_page_file_knows_the_lost_link() -> None:
    assert [path.name for path in OWN if f'"{LINK_LOST}"' in path.read_text("utf-8")] == ["link.js"]


def test_faults_and_options_have_words_in_both_languages() -> None:
    options = {name for kind in KINDS.values() for name in list(inspect.signature(kind.begin).parameters)[1:]}
    wanted = {f"robot.{kind}" for kind in KINDS} | {f"option.{name}" for name in options}
    assert sorted(wanted - set(WORDS["en"])) == []
    assert sorted(wanted - set(WORDS["zh"])) == []


@pytest.mark.parametrize("folder", [FOLDER / "vendor", FOLDER / "studio" / "vendor", TESTS_VENDOR], ids=str)
def test_vendored_files_are_as_published(folder: Path) -> None:
    listed = dict(line.split("  ")[::-1] for line in (folder / "SHA256SUMS").read_text().splitlines())
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert found - {"SHA256SUMS", "README.md"} == set(listed)
    for name, digest in listed.items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest, name


@pytest.mark.parametrize("notice", ["vendor/htm.LICENSE", "studio/vendor/blockly.LICENSE"])
def test_notices_lead_to_the_licence(notice: str) -> None:
    assert (FOLDER / notice).read_text().endswith("the text is in roboglot's own LICENSE\n")
    root = Path(__file__).parents[2]
    assert "LICENSE" in tomllib.loads((root / "pyproject.toml").read_text())["project"]["license-files"]
    text = (root / "LICENSE").read_text()
    assert "Apache License" in text
    assert "END OF TERMS AND CONDITIONS" in text


def test_pages_load_nothing_from_elsewhere() -> None:
    for path in OWN:
        text = path.read_text("utf-8").replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://", text), path
    assert b"'unsafe" not in Assets().policy


def test_the_page_is_small_enough() -> None:
    names = (
        "camera",
        "class",
        "clock",
        "maps",
        "orders",
        "plots",
        "recordings",
        "robots",
        "sign",
        "watch",
        "wire",
        "world",
    )
    views = (f"/views/{name}.js" for name in names)
    shown = (*views, "/copies.js", "/excerpts.js", "/vendor/uplot.mjs", "/vendor/uplot.css")  # loaded when shown
    later = (*shown, "/words/server.zh.json")  # loaded after the page
    sent = {
        path: asset
        for path, asset in Assets().all()
        if path not in ("/index.html", "/words/en.json", *later)
        and not path.startswith(("/studio", "/fleet/"))  # only one language is loaded
    }
    assert sum(len(asset.packed) for asset in sent.values()) < 50 * 1024


def test_pages_leave_the_tab_key_s_start_alone() -> None:
    """Chromium 150 continues with the Tab key behind what a page scrolled into view."""
    own = [path for path in FOLDER.rglob("*.js") if "vendor" not in path.parts]
    assert own
    for path in own:
        assert not re.search(r"(?<!EditorView)\.scrollIntoView\(", path.read_text("utf-8")), path


def test_studio_asks_for_all_its_modules_at_once() -> None:
    text = (FOLDER / "studio" / "index.html").read_text("utf-8")
    asked = set(re.findall(r'rel="modulepreload" href="/([^"]+)"', text))
    later = {"vendor/uplot.mjs", "studio/vendor/codemirror.mjs"}  # with the first plot or text
    packages = set(re.findall(r'":"/([^"]+)"', text)) - later
    wanted, new = packages, {Path("studio/main.js")}
    while new:
        path = new.pop()
        for name in re.findall(r'^import [^;]*?"([./][^"]+)"', (FOLDER / path).read_text("utf-8"), re.MULTILINE):
            found = Path(os.path.normpath(path.parent / name)) if name.startswith(".") else Path(name[1:])
            if str(found) not in wanted:
                wanted.add(str(found))
                new |= {found} if "vendor" not in found.parts else set()
    assert asked == wanted


def test_no_own_file_is_long() -> None:
    assert [path.name for path in OWN if len(Path(path).read_text("utf-8").splitlines()) > 400] == []


def test_selection_is_named_as_safari_knows_it() -> None:
    """Safari has no ``user-select`` but its own: without it, a finger held on the pad selects text."""
    for path in OWN:
        if path.suffix == ".css":
            styles = path.read_text("utf-8")
            own = re.findall(r"-webkit-user-select: (\w+)", styles)
            assert own == re.findall(r"(?<!-)user-select: (\w+)", styles), path.name
