"""Buildings drawn from a seed, for claims about buildings that nothing was tuned on.

Four kinds: ``rooms`` (boxes divided until they are rooms), ``turned`` (half a building and the same again, turned by
half a turn around the middle: no scan tells the halves apart), ``racks`` (a hall with rows of like racks), ``slanted``
(walls at odd angles, round things).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Parts = dict[str, list[dict[str, Any]]]  # "walls", "furniture": tables as written in a world file
Rectangle = tuple[float, float, float, float]  # min x, min y, max x, max y
KINDS = ("rooms", "turned", "racks", "slanted")
SMALLEST, DOOR = 3.2, 1.1  # m, of a room's side and of a door


def _box(draw: np.random.Generator, x: float, y: float, most: float = 1.6) -> dict[str, Any]:
    size = [round(float(draw.uniform(0.4, most)), 2), round(float(draw.uniform(0.3, 0.8)), 2), 1.2]
    facing = float(draw.choice([0.0, 90.0, round(float(draw.uniform(0, 90)), 1)]))
    return {"shape": "box", "at": [round(x, 2), round(y, 2)], "size": size, "facing": facing}


def _wall(start: tuple[float, float], end: tuple[float, float], draw: np.random.Generator) -> dict[str, Any]:
    """Return a wall with a door in a random place."""
    length = math.dist(start, end)
    at = round(float(draw.uniform(DOOR, length - DOOR)), 2)
    return {"from": list(start), "to": list(end), "doors": [{"at": at, "width": DOOR}]}


def _furnish(parts: Parts, room: Rectangle, draw: np.random.Generator) -> None:
    """Up to four things along the walls, away from its middle."""
    min_x, min_y, max_x, max_y = room
    for _ in range(int(draw.integers(0, 5))):
        x, y = float(draw.uniform(min_x + 0.5, max_x - 0.5)), float(draw.choice([min_y + 0.5, max_y - 0.5]))
        parts["furniture"].append(_box(draw, x, y))


def _divide(parts: Parts, room: Rectangle, draw: np.random.Generator) -> None:
    min_x, min_y, max_x, max_y = room
    wide, deep = max_x - min_x, max_y - min_y
    if max(wide, deep) < 2 * SMALLEST or (max(wide, deep) < 3 * SMALLEST and draw.random() < 0.3):
        _furnish(parts, room, draw)
        return
    share = float(draw.uniform(0.35, 0.65))
    if wide >= deep:
        x = round(min(max(min_x + share * wide, min_x + SMALLEST), max_x - SMALLEST), 2)
        parts["walls"].append(_wall((x, min_y), (x, max_y), draw))
        halves = (min_x, min_y, x, max_y), (x, min_y, max_x, max_y)
    else:
        y = round(min(max(min_y + share * deep, min_y + SMALLEST), max_y - SMALLEST), 2)
        parts["walls"].append(_wall((min_x, y), (max_x, y), draw))
        halves = (min_x, min_y, max_x, y), (min_x, y, max_x, max_y)
    for half in halves:
        _divide(parts, half, draw)


def _rooms(parts: Parts, wide: float, deep: float, draw: np.random.Generator) -> None:
    _divide(parts, (0.0, 0.0, wide, deep), draw)


def _turned(parts: Parts, wide: float, deep: float, draw: np.random.Generator) -> None:
    half: Parts = {"walls": [], "furniture": []}
    _divide(half, (0.0, 0.0, wide / 2, deep), draw)

    def over(spot: list[float]) -> list[float]:
        return [round(wide - spot[0], 3), round(deep - spot[1], 3)]

    for wall in half["walls"]:
        parts["walls"] += [wall, wall | {"from": over(wall["from"]), "to": over(wall["to"])}]
    for thing in half["furniture"]:
        parts["furniture"] += [thing, thing | {"at": over(thing["at"])}]
    middle = [{"at": deep / 2, "width": 1.4}]
    parts["walls"].append({"from": [wide / 2, 0.0], "to": [wide / 2, deep], "doors": middle})


def _racks(parts: Parts, wide: float, deep: float, draw: np.random.Generator) -> None:
    for y in np.arange(2.4, deep - 2.0, 2.6):
        for x in np.arange(2.6, wide - 2.0, 3.4):
            if draw.random() < 0.85:
                parts["furniture"].append({"shape": "box", "at": [float(x), float(y)], "size": [2.7, 0.9, 2.0]})
    for _ in range(6):
        x, y = float(draw.uniform(1.0, wide - 1.0)), float(draw.choice([0.4, deep - 0.4]))
        parts["furniture"].append(_box(draw, x, y))


def _slanted(parts: Parts, wide: float, deep: float, draw: np.random.Generator) -> None:
    for x in np.arange(5.0, wide - 4.0, 5.5):
        lean = float(draw.uniform(-1.6, 1.6))
        start, end = (round(float(x) - lean, 2), 0.0), (round(float(x) + lean, 2), deep)
        parts["walls"].append(_wall(start, end, draw))
    for _ in range(14):
        at = [round(float(draw.uniform(0.8, wide - 0.8)), 2), round(float(draw.choice([0.7, deep - 0.7])), 2)]
        radius = round(float(draw.uniform(0.15, 0.5)), 2)
        parts["furniture"].append({"shape": "cylinder", "at": at, "radius": radius, "height": 1.2})


MAKERS: dict[str, Callable[[Parts, float, float, np.random.Generator], None]] = {
    "rooms": _rooms,
    "turned": _turned,
    "racks": _racks,
    "slanted": _slanted,
}


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(part) for part in value) + "]"
    return json.dumps(value)


def generate(kind: str, seed: int, folder: Path) -> Path:
    """Write the world file of the building of that kind and seed."""
    draw = np.random.default_rng([seed, KINDS.index(kind)])
    wide, deep = round(float(draw.uniform(20, 30)), 1), round(float(draw.uniform(12, 18)), 1)
    parts: Parts = {"walls": [], "furniture": []}
    MAKERS[kind](parts, wide, deep, draw)
    lines = [f'name = "{kind}"', "[[floors]]", f'name = "{kind}"', f"size = [{wide}, {deep}]"]
    lines += [f"{key} = {_toml(value)}" for key, value in parts.items()]
    lines.append(f"access_points = [{{ at = [{wide / 2}, {deep / 2}] }}]")
    path = folder / f"{kind}.toml"
    path.write_text("\n".join(lines) + "\n")
    return path
