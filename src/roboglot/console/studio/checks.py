"""Checks of a mission on a program, with the reason of a failure as a sentence in two languages.

A check examines the robot's actions (``Played``) or the program's text (``uses``, ``calls``, ``short``).
"""

from __future__ import annotations

import ast
import itertools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Literal

import msgspec

from roboglot.console.studio.blocks import label_of
from roboglot.console.studio.mistakes import explain
from roboglot.model.geometry import Point
from roboglot.programs.rehearsing import Played, Spot
from roboglot.values import dataclass

TEXT_MAX = 500
PLACES_MAX = 20
HULL, MARGIN = 0.25, 0.015  # m: the dog's radius; the distance that counts as touching
Metres = Annotated[float, msgspec.Meta(ge=-200, le=200)]
Text = Annotated[str, msgspec.Meta(max_length=TEXT_MAX)]
Place = tuple[Metres, Metres]
Walls = Sequence[Sequence[Point]]
COLOURS = {
    "red": (1, 0, 0),
    "green": (0, 1, 0),
    "blue": (0, 0, 1),
    "yellow": (1, 1, 0),
    "white": (1, 1, 1),
    "any": None,
}
COLOURS_ZH = {"red": "红色", "green": "绿色", "blue": "蓝色", "yellow": "黄色", "white": "白色"}
POSTURES_ZH = {"standing": "站立", "sitting": "坐着", "lying": "趴着", "limp": "放松", "changing": "变换姿势"}
CONSTRUCTS: dict[str, tuple[tuple[type[ast.AST], ...], str, str]] = {
    "loop": ((ast.For, ast.While), "a loop", "循环"),
    "if": ((ast.If, ast.IfExp), "a condition", "条件判断"),
    "variable": ((ast.Assign, ast.AugAssign), "a variable", "变量"),
    "function": ((ast.FunctionDef,), "a function of your own", "自己的函数"),
    "list": ((ast.List, ast.ListComp), "a list", "列表"),
    "try": ((ast.Try,), "a plan for failures", "失败时的处理"),
}


class Why(msgspec.Struct, frozen=True):
    """Reason of a failed check, in two languages."""

    en: str
    zh: str


@dataclass(frozen=True, slots=True)
class Work:
    """Work to check: the play, the program's syntax tree, closed outlines of things that must not be touched."""

    played: Played
    tree: ast.Module
    walls: Walls
    start: tuple[float, float]


class Check(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One row of a mission. ``star``: not needed to pass, but for a star. Which fields count depends on kind."""

    kind: Literal[
        "reach", "visit", "home", "no_touch", "say", "print", "light", "posture", "turn", "move", "within", "uses",
        "calls", "short", "ends",
    ]  # fmt: skip
    at: Place = (0.0, 0.0)
    places: Annotated[list[Place], msgspec.Meta(max_length=PLACES_MAX)] = []
    near: Annotated[float, msgspec.Meta(gt=0, le=5)] = 0.3
    text: Text = ""
    seconds: Annotated[float, msgspec.Meta(gt=0, le=600)] = 60.0
    degrees: Annotated[float, msgspec.Meta(ge=-7200, le=7200)] = 0.0
    metres: Annotated[float, msgspec.Meta(ge=0, le=100)] = 0.0
    times: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 1
    most: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 10
    star: bool = False

    def __post_init__(self) -> None:
        if self.kind == "light" and self.text not in COLOURS:
            raise ValueError(f"a light is one of {', '.join(COLOURS)}")
        if self.kind == "uses" and self.text not in CONSTRUCTS:
            raise ValueError(f"a program uses one of {', '.join(CONSTRUCTS)}")
        if self.kind == "print":
            try:
                re.compile(self.text)
            except re.error as error:
                raise ValueError(f"a printed text is a regular expression: {error}") from None


def failure(check: Check, work: Work) -> Why | None:
    """Return why the check is not met, None if it is."""
    return _JUDGES[check.kind](check, work)


def _reach(check: Check, work: Work) -> Why | None:
    return _at(check.at, check.near, work.played.path[-1], "The dog did not end at the goal", "机器狗没有停在目标处")


def _home(check: Check, work: Work) -> Why | None:
    words = "The dog did not come back to where it began", "机器狗没有回到出发点"
    return _at(work.start, check.near, work.played.path[-1], *words)


def _at(place: Place | tuple[float, float], near: float, spot: Spot, en: str, zh: str) -> Why | None:
    missing = math.dist(place, (spot.x, spot.y))
    if missing <= near:
        return None
    return Why(f"{en}: {missing:.1f} m are missing.", f"{zh}：还差 {missing:.1f} 米。")


def _visit(check: Check, work: Work) -> Why | None:
    wanted = list(check.places or [check.at])
    reached = 0
    for spot in work.played.path:
        if reached < len(wanted) and math.dist(wanted[reached], (spot.x, spot.y)) <= check.near:
            reached += 1
    if reached == len(wanted):
        return None
    total = len(wanted)
    if total == 1:
        return Why("The dog did not pass the place that it was to visit.", "机器狗没有经过要去的地方。")
    return Why(
        f"The dog came to {reached} of {total} places, in their order.",
        f"机器狗按顺序到达了 {total} 处中的 {reached} 处。",
    )


def _no_touch(_check: Check, work: Work) -> Why | None:
    for spot in work.played.path:
        if distance(spot, work.walls) < HULL + MARGIN:
            return Why(f"The dog touched something after {spot.at:.0f} s.", f"机器狗在 {spot.at:.0f} 秒时碰到了东西。")
    return None


def _say(check: Check, work: Work) -> Why | None:
    said = [text.casefold() for text in work.played.said]
    found = sum(1 for text in said if check.text.casefold() in text)
    if found >= check.times:
        return None
    if not said:
        return Why("The dog said nothing.", "机器狗什么也没说。")
    what = check.text or "…"
    if not found:
        return Why(f"“{what}” was not said.", f"没有说“{what}”。")
    return Why(
        f"“{what}” was said {_often(found)}; at least {check.times} are needed.",
        f"“{what}”说了 {found} 次，至少要说 {check.times} 次。",
    )


def _often(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _print(check: Check, work: Work) -> Why | None:
    found = len(re.findall(check.text, work.played.printed[:100_000], re.MULTILINE | re.IGNORECASE))
    if found >= check.times:
        return None
    if not work.played.printed.strip():
        return Why("Nothing was printed.", "没有输出任何内容。")
    return Why("Something else was printed than the task asks for.", "输出的内容和任务要求的不一样。")


def _light(check: Check, work: Work) -> Why | None:
    wanted = COLOURS[check.text]
    shown = {tuple(int(part > 60) for part in look[1:]) for look in work.played.colours if any(look[1:])}
    if wanted in shown or (wanted is None and shown):
        return None
    if wanted is None:
        return Why("No light was switched on.", "没有点亮任何灯。")
    return Why(f"No light was {check.text}.", f"没有点亮{COLOURS_ZH[check.text]}的灯。")


def _posture(check: Check, work: Work) -> Why | None:
    if work.played.posture.casefold() == check.text.casefold():
        return None
    now, wanted = (POSTURES_ZH.get(name.casefold(), name) for name in (work.played.posture, check.text))
    return Why(
        f"At the end the dog is {work.played.posture}, not {check.text}.", f"结束时机器狗是{now}，应当是{wanted}。"
    )


def _turn(check: Check, work: Work) -> Why | None:
    turned = math.degrees(sum(_turns(work.played.path)))
    if check.degrees == 0 or abs(turned - check.degrees) <= max(12.0, 0.05 * abs(check.degrees)):
        return None
    return Why(
        f"The dog turned by {turned:.0f} degrees instead of {check.degrees:.0f}.",
        f"机器狗转了 {turned:.0f} 度，应当转 {check.degrees:.0f} 度。",
    )


def _turns(path: Sequence[Spot]) -> Iterator[float]:
    for before, after in itertools.pairwise(path):
        yield math.remainder(after.yaw - before.yaw, math.tau)


def _move(check: Check, work: Work) -> Why | None:
    path = work.played.path
    way = sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(path))
    if way >= check.metres:
        return None
    walked = math.floor(way * 100.0) / 100.0  # rounded down, never up to the required value
    return Why(
        f"The dog walked {walked:.2f} m; at least {check.metres:g} are needed.",
        f"机器狗走了 {walked:.2f} 米，至少要走 {check.metres:g} 米。",
    )


def _within(check: Check, work: Work) -> Why | None:
    if work.played.seconds <= check.seconds and not work.played.late:
        return None
    took = math.ceil(work.played.seconds * 10.0) / 10.0  # rounded up, never down to the allowed value
    return Why(
        f"It took {took:.1f} s; {check.seconds:g} are allowed.", f"用了 {took:.1f} 秒，只允许 {check.seconds:g} 秒。"
    )


def _uses(check: Check, work: Work) -> Why | None:
    kinds, en, zh = CONSTRUCTS[check.text]
    if any(isinstance(node, kinds) and not _header(node) for node in ast.walk(work.tree)):
        return None
    return Why(f"The program does not use {en}.", f"程序没有使用{zh}。")


def _header(node: ast.AST) -> bool:
    """Return whether a statement is the editor's declaration of a variable, ``x = None``."""
    return isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant) and node.value.value is None


def _calls(check: Check, work: Work) -> Why | None:
    found = sum(1 for name, _ in work.played.calls if name.endswith(check.text))
    if found >= check.times:
        return None
    names = label_of(check.text)
    if not found:
        return Why(f"“{names['en']}” was not done.", f"没有执行“{names['zh']}”。")
    return Why(
        f"“{names['en']}” was done {_often(found)}; at least {check.times} are needed.",
        f"“{names['zh']}”执行了 {found} 次，至少要执行 {check.times} 次。",
    )


def _short(check: Check, work: Work) -> Why | None:
    count = sum(isinstance(node, ast.stmt) and not _mark(node) and not _header(node) for node in ast.walk(work.tree))
    if count <= check.most:
        return None
    return Why(
        f"The program has {count} steps; {check.most} are enough.", f"程序有 {count} 步，{check.most} 步就够了。"
    )


def _mark(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and ast.unparse(node).startswith("cyberdog.task.block(")


def _ends(_check: Check, work: Work) -> Why | None:
    if work.played.error:
        why = explain(work.played.error)
        return Why(f"The program ended with an error: {why['en']}", f"程序出错：{why['zh']}")
    return Why("The program did not come to its end.", "程序没有结束。") if work.played.late else None


def distance(spot: Spot, walls: Walls) -> float:
    """Return the distance (m) from the dog's centre to the nearest outline; 0 inside one that is not a room."""
    nearest = math.inf
    for outline in walls:
        for start, end in zip(outline, [*outline[1:], outline[0]], strict=True):
            nearest = min(nearest, _to_line(spot.x, spot.y, start, end))
    return nearest


def _to_line(x: float, y: float, start: Point, end: Point) -> float:
    dx, dy = end.x - start.x, end.y - start.y
    length = dx * dx + dy * dy
    share = 0.0 if length == 0 else max(0.0, min(1.0, ((x - start.x) * dx + (y - start.y) * dy) / length))
    return math.hypot(x - start.x - share * dx, y - start.y - share * dy)


_JUDGES: dict[str, Callable[[Check, Work], Why | None]] = {
    "reach": _reach, "visit": _visit, "home": _home, "no_touch": _no_touch, "say": _say, "print": _print,
    "light": _light, "posture": _posture, "turn": _turn, "move": _move, "within": _within,
    "uses": _uses, "calls": _calls,
    "short": _short, "ends": _ends,
}  # fmt: skip
