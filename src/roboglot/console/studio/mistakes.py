"""Explains a program's failure: its place from the log, and a sentence for pupils in two languages."""

from __future__ import annotations

import re

from roboglot.programs.functions.records import RECORDS
from roboglot.spelling import nearest

_PLACE = re.compile(r" \((?:module (?P<module>\w+), )?line (?P<line>\d+): ", re.DOTALL)
_FIELD = re.compile(r"'(\w+)' object has no attribute '(\w+)'")
_NAME = re.compile(r"'([\w.]+)'")
_GUESS = re.compile(r"; did you mean '(\w+)'\?")

# Explanation and advice, by the error's type and by words in its message.
_SENTENCES: tuple[tuple[str, str, str, str], ...] = (
    ("ZeroDivisionError", "", "Something is divided by zero.", "出现了除以零。"),
    ("NameError", "", "{0} has no value yet: give it one before it is used.", "{0} 还没有值：使用之前先给它赋值。"),
    ("UnboundLocalError", "", "{0} has no value yet in this function.", "在这个函数里 {0} 还没有值。"),
    ("IndexError", "", "The list is not that long. (Python counts places from 0.)",
     "列表没有那么长。（Python 从 0 数位置。）"),
    ("KeyError", "", "The dictionary has no such entry.", "字典里没有这一项。"),
    ("TypeError", "is to be", "A value of another kind is needed here.", "这里需要另一种类型的值。"),
    ("TypeError", "can only concatenate str", "Text and a number cannot be added: use str( ) first.",
     "文字和数字不能相加：先用 str( )。"),
    ("TypeError", "unsupported operand", "These two kinds of values cannot be calculated with each other.",
     "这两种类型的值不能一起计算。"),
    ("TypeError", "missing", "A value is missing between the brackets.", "括号里缺少一个值。"),
    ("TypeError", "", "A value is of the wrong kind here.", "这里的值类型不对。"),
    ("ValueError", "invalid literal for int", "This text is not a whole number.", "这段文字不是整数。"),
    ("ValueError", "", "This value is not possible here.", "这里不能用这个值。"),
    ("AttributeError", "has no", "There is no {1} here.", "这里没有 {1}。"),
    ("AttributeError", "", "{0} cannot be used or changed in programs.", "程序里不能使用或更改 {0}。"),
    ("RecursionError", "", "The function calls itself without an end.", "函数不停地调用自己。"),
    ("MemoryError", "", "The program uses too much memory.", "程序用了太多内存。"),
    ("CpuLimit", "", "The program computes for too long.", "程序计算的时间太长。"),
    ("OutputLimit", "", "The program prints too much.", "程序输出太多。"),
    ("NotImplementedError", "", "This robot cannot do that yet.", "这个机器人还不会这个。"),
    ("ComponentMissing", "", "This robot does not have the part for it.", "这个机器人没有需要的部件。"),
    ("SyntaxError", "", "This line is not written as Python wants it.", "这一行不符合 Python 的写法。"),
    ("AssertionError", "", "A condition that should hold does not.", "应当成立的条件不成立。"),
)  # fmt: skip
_ROBOT = ("The robot could not do this.", "机器人做不到这一步。")


def explain(text: str) -> dict[str, object]:
    """Return an error's line (0: none) and module from a task's log, and ``en`` and ``zh`` sentences or ""."""
    kind, colon, message = text.partition(": ")
    if not colon or not kind.isidentifier():
        return {"line": 0, "module": "", "en": "", "zh": ""}
    place = _PLACE.search(text)
    en, zh = _sentence(kind, message)
    hint = _meant(message)
    if hint:
        en, zh = f"{en} Did you mean {hint}?", f"{zh}是不是想写 {hint}？"
    return {
        "line": int(place["line"]) if place else 0,
        "module": (place["module"] or "") if place else "",
        "en": en,
        "zh": zh,
    }


def _sentence(kind: str, message: str) -> tuple[str, str]:
    names = [*_NAME.findall(message), "?", "?"]
    for wanted, words, english, chinese in _SENTENCES:
        if kind == wanted and words in message:
            return english.format(*names), chinese.format(*names)
    return _ROBOT


def _meant(message: str) -> str:
    """Return the field that was probably meant if a record has none of that name."""
    if guess := _GUESS.search(message):
        return guess[1]
    found = _FIELD.search(message)
    if found is None:
        return ""
    kind, name = found.groups()
    fields = list(RECORDS[kind].fields) if kind in RECORDS else []
    return nearest(name, fields)
