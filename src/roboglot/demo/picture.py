"""Draws the lidar-made map with the tracks on it, one colour each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from roboglot.model.maps import OccupancyGrid

UNKNOWN, FREE, WALL = (205, 209, 214), (250, 250, 248), (43, 48, 56)
COLOURS = ("#d1495b", "#00798c", "#edae49", "#6a4c93")
SIDE = 1200  # pixels along the longer side
LEGEND = 46
INK = "#2b3038"

Track = Sequence[tuple[float, float]]


def draw(grid: OccupancyGrid, tracks: Mapping[str, Track], title: str, path: Path) -> None:
    """Write a PNG of ``grid`` with ``tracks`` by name ((x, y) in map), turned a quarter if that makes it wide."""
    shades = np.full((*grid.log_odds.shape, 3), UNKNOWN, dtype=np.uint8)
    shades[grid.log_odds < 0] = FREE
    shades[grid.log_odds > 0] = WALL
    scale = max(1, SIDE // max(shades.shape))
    size = (grid.width * scale, grid.height * scale)
    image = Image.fromarray(np.flipud(shades)).resize(size, Image.Resampling.NEAREST)
    pen = ImageDraw.Draw(image)
    for track, colour in zip(tracks.values(), COLOURS, strict=False):
        points = [
            (
                (x - grid.origin.x) / grid.resolution * scale,
                size[1] - (y - grid.origin.y) / grid.resolution * scale,
            )
            for x, y in track
        ]
        if len(points) > 1:
            pen.line(points, fill=colour, width=max(3, scale), joint="curve")
        for x, y in points[-1:]:
            pen.ellipse((x - 7, y - 7, x + 7, y + 7), fill=colour)
    if size[1] > size[0]:
        image = image.transpose(Image.Transpose.ROTATE_270)
    _with_legend(image, title, list(tracks)).save(path)


def _with_legend(image: Image.Image, title: str, names: list[str]) -> Image.Image:
    """Return the picture below a legend of its colours."""
    canvas = Image.new("RGB", (max(image.width, SIDE), image.height + LEGEND), "white")
    canvas.paste(image, ((canvas.width - image.width) // 2, LEGEND))
    pen, font = ImageDraw.Draw(canvas), ImageFont.load_default(18)
    pen.text((10, 12), title, fill=INK, font=font)
    left = 30 + pen.textlength(title, font=font)
    for name, colour in zip(names, COLOURS, strict=False):
        pen.rectangle((left, 17, left + 16, 29), fill=colour)
        pen.text((left + 22, 12), name, fill=INK, font=font)
        left += 42 + pen.textlength(name, font=font)
    return canvas
