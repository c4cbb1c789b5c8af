"""Chinese pages beside the English ones: the same commands, settings and figures, and the words of the web pages."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.docs.test_docs import FENCE, ROOT

CHINESE = sorted([ROOT / "README.zh.md", *(ROOT / "docs").rglob("*.zh.md")])
CODE = re.compile(r"`([^`]+)`")
NUMBER = re.compile(r"(?<![\w.])\d+(?:[.,]\d+)*(?!\w)")
HAN = re.compile(r"[\u3000-\u9fff\uff00-\uffef]")
COMMENT = re.compile(r"(?:^|\s+)(?:#|//) .*$", re.MULTILINE)
ADDRESS = re.compile(r"\]\([^)]*\)")
EMPHASIS = re.compile(r"(?<![*\w])\*([^*\n]+(?:\n[^*\n]+)?)\*(?![*\w])")
# One word for one thing, as on the console's pages.
TERMS = {"扇门": "接口", "门上": "接口", "机体": "机身", "逐步时钟": "锁步", "充电座": "充电桩"}
TERMS |= {"摄像头": "相机", "真狗": "真机", "映像": "镜像", "数据目录": "数据文件夹", "设置文件": "配置文件"}
TERMS |= {"附加包": "附加组件", "登记库": "注册中心", "登记处": "注册中心", "MQTT 代理": "MQTT 服务器"}
TERMS |= {"您": "你", "班级": "课堂", "野外": "现场"}
# Pages of the studio and the console, whose buttons the pages of the documentation quote in italics.
PAGES = ("console", "programs/studio")
RIGHTS = {"admin"}
every_chinese_page = pytest.mark.parametrize("page", CHINESE, ids=lambda page: str(page.relative_to(ROOT)))


def flat(text: str) -> str:
    return re.sub(r"\s+", " ", text)


def english(page: Path) -> str:
    return page.with_name(page.name.replace(".zh.md", ".md")).read_text("utf-8")


def lines(text: str) -> set[str]:
    """Lines of its blocks of code, without comments."""
    return {line.strip() for _, code in FENCE.findall(text) for line in COMMENT.sub("", code).split("\n") if line}


@every_chinese_page
def test_chinese_pages_name_what_the_english_name(page: Path) -> None:
    """A name that was changed on one page alone is old on the other one."""
    known = flat(english(page))
    named = {flat(code) for code in CODE.findall(FENCE.sub("", page.read_text("utf-8")))}
    assert {code for code in named if code not in known and not HAN.search(code)} == set()


@every_chinese_page
def test_chinese_pages_have_the_english_figures(page: Path) -> None:
    text = ADDRESS.sub("", CODE.sub("", FENCE.sub("", page.read_text("utf-8"))))
    assert set(NUMBER.findall(text)) - set(NUMBER.findall(english(page))) == set()


@every_chinese_page
def test_chinese_blocks_have_the_english_lines(page: Path) -> None:
    known = lines(english(page))
    assert {line for line in lines(page.read_text("utf-8")) - known if not HAN.search(line)} == set()


@pytest.mark.parametrize("name", ["cyberdog", "slamware", "visual"])
def test_pages_of_the_same_content_leave_nothing_out(name: str) -> None:
    page = ROOT / f"docs/protocols/{name}.zh.md"
    text = page.read_text("utf-8")
    assert "内容相同" in text
    wanted = {flat(code) for code in CODE.findall(FENCE.sub("", english(page)))}
    left_out = {code for code in wanted if code not in flat(text)}
    assert {code for code in left_out if not re.search(r"\b[A-Z]{3,}$|parameters", code)} == set(), "or translated"


@every_chinese_page
def test_chinese_words_are_those_of_the_console(page: Path) -> None:
    text = page.read_text("utf-8")
    assert {word: better for word, better in TERMS.items() if word in text} == {}


def test_console_has_one_chinese_word_for_one_thing() -> None:
    for file in (ROOT / "src/roboglot/console/web").rglob("words/*zh.json"):
        text = file.read_text("utf-8")
        assert {word: better for word, better in TERMS.items() if word in text} == {}, file


@pytest.mark.parametrize("suffix", [".md", ".zh.md"])
@pytest.mark.parametrize("name", PAGES)
def test_quoted_buttons_are_on_the_page(name: str, suffix: str) -> None:
    language = "zh" if suffix == ".zh.md" else "en"
    words: set[str] = set()
    for file in (ROOT / "src/roboglot/console/web").rglob(f"words/{language}.json"):
        words |= set(json.loads(file.read_text("utf-8")).values())
    shown = "\n".join(words | {"Help", "帮助"}).lower()  # Blockly's own
    text = FENCE.sub("", (ROOT / f"docs/{name}{suffix}").read_text("utf-8"))
    quoted = {flat(word) for word in EMPHASIS.findall(text)} - RIGHTS
    assert {word for word in quoted if word.lower() not in shown} == set()
