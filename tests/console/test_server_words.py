"""Sentences of the server on pages: each of the sources has its Chinese, and none is kept for nothing."""

from __future__ import annotations

import json
import re
from itertools import combinations
from pathlib import Path

import pytest

from roboglot.config import REMEDY
from roboglot.console.assets import FOLDER
from roboglot.simulation.components.sensing.bumper import MIDDLES
from roboglot.simulation.world.placing import EDGE, GAP, IN_THE_WAY, ROBOT
from roboglot.validation import FORMS, KINDS, PYTHON
from tests.console.server_sentences import sentences

KNOWN: dict[str, str] = json.loads((FOLDER / "words" / "server.zh.json").read_text("utf-8"))
SMALL = {"ahead", "behind", "in", "out "}  # words that fill a gap
WORDS = {
    *KINDS.values(),
    *PYTHON.values(),
    "a fraction",
    "a key of {}",
    "the body",
    "the value",
    "configuration: {}",
    REMEDY,
    "; {}",
    "; use {}",
    "; use one of {}",
    "; it belongs in {}",
    "; it belongs in the outermost object",
    EDGE,
    GAP,
    ROBOT,
    *IN_THE_WAY.values(),
} - {"None"}


def test_sides_of_a_bumper_have_chinese_names() -> None:
    words: dict[str, str] = json.loads((FOLDER / "words" / "zh.json").read_text("utf-8"))
    pairs = {" and ".join(pair) for pair in combinations(MIDDLES, 2)}
    assert {f"robot.{sides}" for sides in {*MIDDLES, *pairs}} <= words.keys()


def test_each_sentence_of_the_server_has_its_chinese() -> None:
    missing = {text: place for text, place in sentences().items() if text not in KNOWN}
    missing |= dict.fromkeys((FORMS | WORDS) - KNOWN.keys(), "validation.py")
    assert missing == {}, "add their Chinese to console/web/words/server.zh.json, sorted"


def test_no_sentence_that_is_gone_is_kept() -> None:
    assert sorted(set(KNOWN) - set(sentences()) - SMALL - WORDS - FORMS) == []


def test_chinese_sentences_fill_in_the_same() -> None:
    assert list(KNOWN) == sorted(KNOWN)
    gaps = {text: {int(number) for number in re.findall(r"\{(\d)\}", chinese)} for text, chinese in KNOWN.items()}
    used = {text for text, numbers in gaps.items() if numbers - set(range(text.count("{}")))}
    assert used == set()
    lost = {text for text, numbers in gaps.items() if set(range(text.count("{}"))) - numbers}
    assert lost == set()
    assert [text for text in KNOWN if not re.search("[一-鿿]", KNOWN[text])] == ["; {}"]


@pytest.mark.parametrize(
    "source",
    [
        'raise Refused(f"a new {name} sentence")',
        'raise NotFound("a new " + name + " sentence")',
        'action.cancel("a new {} sentence")',
        'why = f"a new {1} sentence" if it else ""',
        'health.set(NAME, True, "lidar", ERROR, f"a new {x} sentence")',
    ],
)
def test_a_new_sentence_is_found(tmp_path: Path, source: str) -> None:
    (tmp_path / "console").mkdir()
    (tmp_path / "console" / "new.py").write_text(
        f"class RobotError(Exception): ...\nclass Refused(RobotError): ...\nclass NotFound(RobotError): ...\n{source}\n"
    )
    assert list(sentences(tmp_path)) == ["a new {} sentence"]
