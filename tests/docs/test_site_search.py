"""The site's search: Chinese words are found within sentences."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def search() -> ModuleType:
    spec = importlib.util.spec_from_file_location("site_search", ROOT / "scripts/site_search.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_sentences_are_divided_into_known_words(search: ModuleType) -> None:
    known = {"机器人", "充电桩", "充电"}
    text = search.divided("<p>机器人回到充电桩，用Python充电</p>", known)
    assert text.split(search.GAP) == ["<p>", *("机器人", "回", "到", "充电桩"), "，", "用", "Python", "充电", "</p>"]
    assert text.replace(search.GAP, "") == "<p>机器人回到充电桩，用Python充电</p>"
    assert search.divided("no Chinese", known) == "no Chinese"


def test_words_are_those_of_the_project(search: ModuleType) -> None:
    assert {"录制", "比较", "课堂", "充电桩", "控制权"} <= search.words()


def test_both_forms_of_the_index_are_divided(search: ModuleType, tmp_path: Path) -> None:
    folder = tmp_path / "search"
    folder.mkdir()
    page = {"location": "zh/x.html", "title": "录制文件", "text": "比较录制"}
    (folder / "search_index.json").write_text(json.dumps({"config": {}, "docs": [page]}))
    search.on_post_build({"site_dir": str(tmp_path)})
    index = json.loads((folder / "search_index.json").read_text())
    separator = re.search(r"separator: '([^']+)'", (ROOT / "mkdocs.yml").read_text("utf-8"))
    assert separator is not None
    found = [word for word in re.split(separator[1], index["docs"][0]["text"]) if word]
    assert found == ["比较", "录制"]
    script = (folder / "search_index.js").read_text()
    assert json.loads(script.removeprefix("var __index = ")) == index
