"""Masks that mix two colours over a surface: tiles, wood, plaster, shelves, visual markers. Row 0 is below."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from enum import IntEnum
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from roboglot.model.perception import TagKind
from roboglot.simulation.building.printed_codes import april, qr

Floats = NDArray[np.float64]
SIZE = 256
SMALLEST = 2
SPARES_MAX = 32  # symbols requested later; more than can hang at the same time
CODE = "code "
Mask = NDArray[np.uint32]


def code_symbol(kind: TagKind, text: str) -> str:
    """Return the name of a printed code in ``Masks``."""
    return f"{CODE}{kind} {text}"


class Texture(IntEnum):
    """The surfaces; further numbers are symbols, from ``Masks.symbol``."""

    TILES = 0
    CARPET = 1
    WOOD = 2
    WALL = 3
    CEILING = 4
    SHELF = 5
    DRAWERS = 6
    WINDOW = 7
    BOX = 8


class Masks:
    """All masks with their smaller copies, one row each, in the shading kernel's form."""

    def __init__(self, symbols: Sequence[str] = ()) -> None:
        names = list(dict.fromkeys(symbols))
        self._symbols = {name: len(Texture) + number for number, name in enumerate(names)}
        surfaces = [_PAINTERS[texture] for texture in Texture]
        self._spare: OrderedDict[str, int] = OrderedDict()  # requested later, oldest first
        self._growing = threading.Lock()
        self.rows: Mask = np.stack([*(_surface(painter) for painter in surfaces), *(_symbol(name) for name in names)])

    def symbol(self, name: str) -> int:
        """Return the texture of a symbol; one unknown at the start gets a spare row."""
        known = self._symbols.get(name)
        return self._spare_row(name) if known is None else known

    def _spare_row(self, name: str) -> int:
        """Return a row for ``name``; rows in use are not overwritten: other threads may be drawing."""
        with self._growing:
            if name in self._spare:
                self._spare.move_to_end(name)
            elif len(self._spare) < SPARES_MAX:
                self._spare[name] = len(self.rows)
                self.rows = np.concatenate((self.rows, _symbol(name)[None]))
            else:
                _, row = self._spare.popitem(last=False)
                rows = self.rows.copy()
                rows[row] = _symbol(name)
                self.rows, self._spare[name] = rows, row
            return self._spare[name]


@cache
def _surface(painter: Callable[[], Floats]) -> Mask:
    return _with_copies(painter())


@lru_cache(maxsize=64)  # for worlds, and for tags that users invent
def _symbol(name: str) -> Mask:
    match name:
        case "heart":
            return _with_copies(_heart())
        case "stop":
            rows, columns = _grid()
            return _with_copies(np.where(np.maximum(abs(rows - 0.5), abs(columns - 0.5)) < 0.32, 255.0, 0.0))
        case "forward" | "left" | "backward" | "right":
            return _with_copies(np.rot90(_arrow(), -("forward", "left", "backward", "right").index(name)).copy())
        case _ if name.startswith(CODE):
            return _with_copies(_code(*name.removeprefix(CODE).split(" ", 1)))
        case _:
            return _with_copies(_letters(name))


def _with_copies(mask: Floats) -> Mask:
    """Return a mask (256 x 256, 0..255) and its halves down to SMALLEST as one row; a texel holds neighbours, too."""
    parts = []
    while len(mask) >= SMALLEST:
        texels = np.clip(mask + 0.5, 0, 255).astype(np.uint32)
        right, above = np.roll(texels, -1, axis=1), np.roll(texels, -1, axis=0)
        parts.append((texels | right << 8 | above << 16 | np.roll(above, -1, axis=1) << 24).ravel())
        mask = (mask[::2, ::2] + mask[1::2, ::2] + mask[::2, 1::2] + mask[1::2, 1::2]) / 4
    return np.concatenate(parts)


def _grid() -> tuple[Floats, Floats]:
    rows, columns = np.mgrid[0:SIZE, 0:SIZE].astype(np.float64) / SIZE
    return rows, columns


def _noise(cells: int, seed: int, strength: float) -> Floats:
    """Return smooth random hills around 0 that match at the edges."""
    random = np.random.Generator(np.random.PCG64(seed)).standard_normal((cells, cells))
    random = np.concatenate((random, random[:1]))
    random = np.concatenate((random, random[:, :1]), axis=1)
    at = np.arange(SIZE) * cells / SIZE
    low = at.astype(int)
    part = (at - low)[:, None]
    rows = random[low] * (1 - part) + random[low + 1] * part
    part = part.T
    smooth: Floats = strength * (rows[:, low] * (1 - part) + rows[:, low + 1] * part)
    return smooth


def _tiles() -> Floats:
    """Four tiles by four with joints."""
    rows, columns = _grid()
    joint = ((rows * 4) % 1 < 0.03) | ((columns * 4) % 1 < 0.03)
    tone = np.random.Generator(np.random.PCG64(4)).uniform(0, 45, (4, 4)).repeat(64, 0).repeat(64, 1)
    return np.where(joint, 220.0, 20 + tone + _noise(64, 1, 6))


def _carpet() -> Floats:
    rows, columns = _grid()
    squares = (np.floor(rows * 4) + np.floor(columns * 4)) % 2
    return 70 + 40 * squares + _noise(128, 2, 22) + _noise(16, 3, 8)


def _wood() -> Floats:
    """Boards along the first axis, eight of them, with grain."""
    rows, columns = _grid()
    board = np.floor(rows * 8)
    shade = np.random.Generator(np.random.PCG64(5)).uniform(20, 120, 8)[board.astype(int)]
    grain = 14 * np.sin(2 * math.pi * (rows * 48 + 0.5 * np.sin(2 * math.pi * (columns + board / 3)))) + _noise(
        32, 6, 8
    )
    ends = (columns + board * 0.37) % 1 < 0.006
    return np.where(((rows * 8) % 1 < 0.05) | ends, 235.0, shade + grain)


def _wall() -> Floats:
    """Plaster from the floor (with a skirting board) to the ceiling, darker in the edges."""
    rows, _ = _grid()
    edges = 70 * np.exp(-rows / 0.05) + 45 * np.exp(-(1 - rows) / 0.06)
    return np.where(rows < 0.03, 255.0, 8 + edges + _noise(64, 7, 3) + _noise(8, 8, 4))


def _ceiling() -> Floats:
    """Four by four panels, one of them a lamp."""
    rows, columns = _grid()
    joint = ((rows * 4) % 1 < 0.03) | ((columns * 4) % 1 < 0.03)
    lamp = (rows > 0.27) & (rows < 0.5) & (columns > 0.02) & (columns < 0.5)
    return np.where(joint, 90.0, np.where(lamp, 255.0, 140 + _noise(64, 9, 5)))


def _shelf() -> Floats:
    """Four boards with books in many shades."""
    rows, columns = _grid()
    random = np.random.Generator(np.random.PCG64(10))
    spines = random.uniform(30, 255, (4, 32)).repeat(64, 0).repeat(8, 1)
    heights = random.uniform(0.55, 0.85, (4, 32)).repeat(64, 0).repeat(8, 1)
    within = (rows * 4) % 1
    books = np.where((within > 0.1) & (within < heights), spines, 25.0)
    return np.where(within < 0.1, 120.0, np.where(columns < 0.015, 120.0, books))


def _drawers() -> Floats:
    """Two by three fronts with handles."""
    rows, columns = _grid()
    y, x = (rows * 3) % 1, (columns * 2) % 1
    gap = (y < 0.04) | (x < 0.03)
    handle = (np.abs(y - 0.75) < 0.035) & (np.abs(x - 0.5) < 0.14)
    return np.where(gap, 230.0, np.where(handle, 200.0, 30 + _noise(32, 11, 5)))


def _window() -> Floats:
    """Return a frame (mask 0) around two panes; the sky grows brighter upwards."""
    rows, columns = _grid()
    frame = (np.abs(rows - 0.5) > 0.45) | (np.abs(columns - 0.5) > 0.46) | (np.abs(columns - 0.5) < 0.02)
    return np.where(frame, 0.0, 150 + 105 * rows)


def _cardboard() -> Floats:
    """Brown paper with tape across."""
    rows, columns = _grid()
    edge = (np.minimum(rows, 1 - rows) < 0.02) | (np.minimum(columns, 1 - columns) < 0.02)
    tape = np.abs(columns - 0.5) < 0.07
    return np.where(edge, 200.0, np.where(tape, 120.0, 20 + _noise(64, 12, 6)))


def _letters(text: str) -> Floats:
    """Return up to three characters, as large as possible."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.new("L", (SIZE, SIZE))
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(size=230 if len(text) == 1 else 110)
    draw.text((SIZE / 2, SIZE / 2), text, fill=255, font=font, anchor="mm", stroke_width=6, stroke_fill=255)
    return np.asarray(image, dtype=np.float64)[::-1]


def _heart() -> Floats:
    rows, columns = _grid()
    x, y = (columns - 0.5) * 3.0, (rows - 0.45) * 3.0
    return np.where((x**2 + y**2 - 1) ** 3 < x**2 * y**3, 255.0, 0.0)


def _code(kind: str, text: str) -> Floats:
    """Return the code's black and white squares."""
    squares = april(int(text)) if kind == TagKind.APRIL else qr(text)
    index = np.arange(SIZE) * len(squares) // SIZE
    mask: Floats = squares[::-1][index][:, index].astype(np.float64) * 255.0
    return mask


def _arrow() -> Floats:
    """Return an arrow that points up (row 0 is at the bottom)."""
    rows, columns = _grid()
    off = np.abs(columns - 0.5)
    head = (rows > 0.5) & (off < (0.9 - rows) * 0.95)
    return np.where(head | ((rows > 0.1) & (rows <= 0.5) & (off < 0.13)), 255.0, 0.0)


_PAINTERS: dict[Texture, Callable[[], Floats]] = {
    Texture.TILES: _tiles,
    Texture.CARPET: _carpet,
    Texture.WOOD: _wood,
    Texture.WALL: _wall,
    Texture.CEILING: _ceiling,
    Texture.SHELF: _shelf,
    Texture.DRAWERS: _drawers,
    Texture.WINDOW: _window,
    Texture.BOX: _cardboard,
}
