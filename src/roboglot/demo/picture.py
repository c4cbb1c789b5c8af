"""Draws the lidar-made map with the tracks on it, one colour each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from roboglot.model.maps import OccupancyGrid

UNKNOWN, FREE, WALL = (205, 209, 214), (250, 250, 248), (43, 48, 56)
COLOURS = ("#d1495b", "#00798c", "#edae49", "#6a4c93")
SIDE = 1200  # pixels of the longer side
LEGEND = 46

Track = Sequence[tuple[float, float]]


def draw(grid: OccupancyGrid, tracks: Mapping[str, Track], title: str, path: Path) -> None:
    """Write a PNG: ``grid`` (map frame), ``tracks`` by name as (x, y) in map, y up."""
    cells = np.flipud(grid.log_odds)
    shades = np.full((*cells.shape, 3), UNKNOWN, dtype=np.uint8)
    shades[cells < 0] = FREE
    shades[cells > 0] = WALL
    scale = max(1, SIDE // max(cells.shape))
    size = (cells.shape[1] * scale, cells.shape[0] * scale)
    canvas = Image.new("RGB", (max(size[0], 640), size[1] + LEGEND), "white")
    canvas.paste(Image.fromarray(shades).resize(size, Image.Resampling.NEAREST), (0, LEGEND))
    pen = ImageDraw.Draw(canvas)

    def pixel(x: float, y: float) -> tuple[float, float]:
        return (
            (x - grid.origin.x) / grid.resolution * scale,
            LEGEND + size[1] - (y - grid.origin.y) / grid.resolution * scale,
        )

    font = ImageFont.load_default(18)
    pen.text((10, 12), title, fill="#2b3038", font=font)
    left = 20 + pen.textlength(title, font=font)
    for (name, track), colour in zip(tracks.items(), COLOURS, strict=False):
        points = [pixel(x, y) for x, y in track]
        if len(points) > 1:
            pen.line(points, fill=colour, width=max(3, scale // 2), joint="curve")
        if points:
            x, y = points[-1]
            pen.ellipse((x - 6, y - 6, x + 6, y + 6), fill=colour)
        pen.rectangle((left, 17, left + 16, 29), fill=colour)
        pen.text((left + 22, 12), name, fill="#2b3038", font=font)
        left += 42 + pen.textlength(name, font=font)
    canvas.save(path)
