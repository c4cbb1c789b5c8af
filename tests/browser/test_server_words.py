"""Chinese pages say in Chinese what the server refuses; English ones as it came."""

from __future__ import annotations

import json
import re

import pytest

from roboglot.console.assets import FOLDER
from roboglot.shards.shard import settings_of
from tests.browser.served import OpenConsole, until
from tests.browser.test_studio import FOREVER, Open, loaded, studio

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")
KNOWN: dict[str, str] = json.loads((FOLDER / "words" / "server.zh.json").read_text("utf-8"))
TRANSLATED = "async (texts) => { const base = await import('/base.js'); return texts.map(base.translated); }"
LEARNT = """async () => {
    const base = await import('/base.js');
    const known = () => base.translated('no class is open') !== 'no class is open';
    while (!known()) await new Promise((after) => setTimeout(after, 50));
}"""


def filled(text: str, marks: list[str]) -> str:
    """Return the sentence with these in its gaps."""
    left = iter(marks)
    return re.sub(r"\{\d?\}", lambda gap: marks[int(gap[0][1:-1])] if gap[0] != "{}" else next(left), text)


def refused(settings: dict[str, object]) -> str:
    with pytest.raises(ValueError, match=" ") as error:
        settings_of(settings)
    return str(error.value)


async def test_reasons_of_worlds_down_are_chinese(open_console: OpenConsole) -> None:
    page = await open_console(language="zh")
    await page.evaluate(LEARNT)
    wrong: list[dict[str, object]] = [
        {"foxglove": {"dead_man": 0}},
        {"foxglove": {"dead_man": "x"}},
        {"access": {"tls": {"certificate": "x"}}},
        {"console": {"otlp": "x"}},
        {"robots": [{"colour": 1}]},
        {"robots": []},
        {"cyberdog": {"app": "x"}},
    ]
    assert await page.evaluate(TRANSLATED, [refused(settings) for settings in wrong]) == [
        "配置：foxglove.dead_man 是 0.05 到 60 秒",
        "配置：foxglove.dead_man 应当是数字，不能是文字",
        "配置：[access.tls] 要么同时给出 certificate 和 key，要么都不给",
        "配置：console.otlp 是收集器的 http:// 或 https:// 地址，不能是 'x'",
        "配置：robots.colour 不是设置；有 name, body, address, start, priority, serial",
        "机器人有 1 到 100 个，不能是 0",
        "配置：cyberdog.app 是 HOST:PORT，不能是 'x'",
    ]


async def test_every_sentence_is_shown_in_chinese(open_console: OpenConsole) -> None:
    page = await open_console(language="zh")
    await page.evaluate(LEARNT)
    marks = [f"<{number}>" for number in range(9)]
    texts = {filled(en, marks): filled(zh, marks) for en, zh in KNOWN.items() if "{}{}" not in en and en != "; {}"}
    found = await page.evaluate(TRANSLATED, list(texts))
    assert dict(zip(texts, found, strict=True)) == texts
    twice = "The current operation(run) is illegal: 7 is in 8. Recover it to go on, or shut it down first."
    nested = "not stopped: the robot is off"
    long = "x" * 200_000 + " is not a name"
    allowed = ["sound cannot be 'x'; use one of claps, tone", "yaw is unknown; there are x, y"]
    allowed += ["no class is open; no class is open", "no class is open; a line without its Chinese"]
    allowed += ["degree is unknown; did you mean 'degrees'?", "there is no verb 'stpo'; did you mean 'stop'?"]
    assert await page.evaluate(TRANSLATED, allowed) == [
        "sound 不能是 'x'；请用 claps, tone 之一",
        "没有 yaw 这一项；有 x, y",
        f"{KNOWN['no class is open']}；{KNOWN['no class is open']}",
        f"{KNOWN['no class is open']}；a line without its Chinese",
        "没有 degree 这一项；是不是 'degrees'？",
        "没有指令 'stpo'；是不是 'stop'？",
    ]
    assert await page.evaluate(TRANSLATED, [twice, nested, "a line without its Chinese", long]) == [
        "现在不能进行操作（run）：7 处于 8。先恢复它再继续，或先结束它。",
        "没有停下：机器人已关机",
        "a line without its Chinese",
        "x" * 200_000 + " 不能作名称",
    ]
    english = await open_console(language="en")
    assert await english.evaluate(TRANSLATED, ["no class is open"]) == ["no class is open"]


@pytest.mark.parametrize(
    ("language", "said"),
    [
        ("zh", "被拒绝：没有课堂 'NO'"),
        pytest.param("en", "Refused: there is no class 'NO'", marks=pytest.mark.slow),  # as it comes
    ],
)
async def test_refusals_are_in_the_language_of_the_page(studio: Open, language: str, said: str) -> None:
    page = await studio(language=language)
    if language == "zh":
        await page.evaluate(LEARNT)
    await page.click("#tab-group")
    await page.fill("input[name=code]", "NO")
    await page.fill("form:nth-of-type(1) input[name=name]", "Anna")
    await page.click("form:nth-of-type(1) button")
    await until(page, f"document.querySelector('.notice').textContent === {json.dumps(said)}")


async def test_labels_of_blocks_are_chinese_too(studio: Open) -> None:
    page = await studio(language="zh")
    await loaded(page, FOREVER)
    await until(page, "document.querySelector('.blocklyZoomIn, .blocklyZoom')")
    labels = await page.evaluate("[...document.querySelectorAll('.workspace [aria-label]')].map(e => e.ariaLabel)")
    assert labels
    assert [label for label in labels if re.search("[A-Za-z]{4}", label)] == []
