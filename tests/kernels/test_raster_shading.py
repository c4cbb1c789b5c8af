"""Colours of a picture: textures, light and strips, against the same sums done for each pixel with numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roboglot.kernels.lanes import MARGIN
from roboglot.kernels.layouts import COEFFICIENTS, FIRST
from roboglot.kernels.raster import CORNERS_MAX, project
from roboglot.kernels.raster_shading import BAND, DARKEST, HAZE, LINE, OFFSETS, SAMPLES, STRIP, shade

WIDTH, HEIGHT = 320, 200
FOCAL = WIDTH / 2 / math.tan(math.radians(35))
AHEAD_X = np.array(((0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)))
PAINT = (120.0, -20.0, 30.0, 60.0 / 255, 40.0 / 255, -50.0 / 255, 0.9, 1.0)


def copies(mask):
    """A mask (256 x 256) and its smaller copies in the kernel's form."""
    parts = []
    while len(mask) >= 2:
        texels = np.clip(mask + 0.5, 0, 255).astype(np.uint32)
        right, above = np.roll(texels, -1, axis=1), np.roll(texels, -1, axis=0)
        parts.append((texels | right << 8 | above << 16 | np.roll(above, -1, axis=1) << 24).ravel())
        mask = (mask[::2, ::2] + mask[1::2, ::2] + mask[::2, 1::2] + mask[1::2, 1::2]) / 4
    return np.concatenate(parts)[None]


def picture(corners, mappings, mask, texture=0):
    """A picture of these quads, all of the same paint."""
    count, numbers = len(corners), FIRST + len(corners)
    planes, sources = np.zeros((numbers, COEFFICIENTS)), np.zeros(numbers, np.int32)
    outlines, spans = np.zeros((numbers, CORNERS_MAX, 2)), np.zeros((numbers, 3), np.int32)
    lens, rooms = np.array((FOCAL, WIDTH / 2, HEIGHT / 2)), np.zeros(count, np.int32)
    drawn = project(
        corners,
        mappings,
        rooms,
        np.ones(1, np.uint8),
        AHEAD_X,
        np.zeros(3),
        lens,
        planes,
        sources,
        outlines,
        spans,
        FIRST,
    )
    planes[0, 2] = planes[1, 2] = 1.0
    luma = np.zeros((HEIGHT, WIDTH), np.uint8)
    blue, red = (np.zeros((HEIGHT // 2, WIDTH // 2), np.uint8) for _ in range(2))
    cells = np.zeros((4, 4), np.uint8)
    shade(
        outlines, spans, FIRST + drawn, planes, sources, np.array([PAINT] * count, np.float32),
        np.full(count, texture, np.int32), copies(mask), cells, cells, np.array((0.0, 0.0, 1.0)), 1.0,
        np.empty((BAND, 2)), np.empty((BAND, WIDTH + MARGIN), np.float32), np.empty((BAND, WIDTH + MARGIN), np.uint16),
        np.zeros(SAMPLES, np.int32), np.zeros((3, WIDTH + LINE), np.uint8), luma, blue, red,
    )  # fmt: skip
    return luma, blue, red


def wall(x0, x1, tile):
    """A wall that fills the picture, ``x0`` ahead on the left and ``x1`` on the right, with square tiles (m)."""
    left, right = x0 * WIDTH / 2 / FOCAL * 1.05, -x1 * WIDTH / 2 / FOCAL * 1.05
    high = max(x0, x1)
    corners = np.array([[(x0, left, -high), (x1, right, -high), (x1, right, high), (x0, left, high)]])
    along = (corners[0, 1] - corners[0, 0]) / np.linalg.norm(corners[0, 1] - corners[0, 0])
    return corners, np.array([[corners[0, 0], along / tile, (0.0, 0.0, 1.0 / tile)]])


def wanted(corners, mappings, mask):
    """Luma and mask of each pixel, the texture mixed between its texels."""
    columns, rows = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    rays = np.stack((np.ones_like(columns), (WIDTH / 2 - columns) / FOCAL, (HEIGHT / 2 - rows) / FOCAL), -1)
    normal = np.cross(corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0])
    away = (normal @ corners[0, 0]) / (rays @ normal)
    points = rays * away[..., None] - mappings[0, 0]
    u, v = points @ mappings[0, 1] * 256, points @ mappings[0, 2] * 256
    i, j = np.floor(v).astype(int), np.floor(u).astype(int)
    p, q = u - j, v - i
    lower = mask[i % 256, j % 256] * (1 - p) + mask[i % 256, (j + 1) % 256] * p
    upper = mask[(i + 1) % 256, j % 256] * (1 - p) + mask[(i + 1) % 256, (j + 1) % 256] * p
    mixed = lower * (1 - q) + upper * q
    fade = 1 + PAINT[7] * (DARKEST + (1 - DARKEST) / (1 + HAZE * away) - 1)
    light = PAINT[6] * fade
    return 16 + light * (PAINT[0] + PAINT[3] * mixed), mixed, light


def hills():
    rows, columns = np.mgrid[0:256, 0:256] * (2 * np.pi / 256)
    return np.floor(127 + 60 * np.sin(3 * columns + 1) * np.cos(2 * rows) + 60 * np.sin(5 * rows))


@pytest.mark.parametrize("ends", [(2.0, 2.0), (1.5, 4.0)], ids=["ahead", "slanting"])
@pytest.mark.parametrize("tile", [4.0, 1.5], ids=["every second pixel", "every pixel"])
def test_texture_and_light_are_exact_for_each_pixel(ends, tile):
    mask, (corners, mappings) = hills(), wall(*ends, tile)
    luma, blue, red = picture(corners, mappings, mask)
    brightness, mixed, light = wanted(corners, mappings, mask)
    off = np.abs(luma - brightness)
    assert off.mean() < 1.0
    assert off.max() < 7.0
    even = (slice(None, None, 2), slice(None, None, 2))
    for plane, first, step in ((blue, PAINT[1], PAINT[4]), (red, PAINT[2], PAINT[5])):
        assert np.abs(plane - (128 + light[even] * (first + step * mixed[even]))).max() < 6.0


def test_plain_walls_are_even_far_ones_smooth():
    corners, mappings = wall(2.0, 2.0, 1.0)
    luma, blue, red = picture(corners, mappings, hills(), texture=-1)
    light = PAINT[6] * (DARKEST + (1 - DARKEST) / (1 + 2 * HAZE))
    assert np.abs(luma - (16 + light * PAINT[0])).max() <= 1
    assert np.abs(blue - (128 + light * PAINT[1])).max() <= 1
    assert np.abs(red - (128 + light * PAINT[2])).max() <= 1
    stripes = np.tile(np.array((0.0, 255.0)), (256, 128))
    luma, *_ = picture(*wall(20.0, 20.0, 1.0), stripes)
    assert luma.std() < 1.0  # grey, not a moiré
    assert OFFSETS[1] == 256 * 256


def test_surfaces_look_alike_on_both_sides():
    mask, (corners, mappings) = hills(), wall(1.5, 4.0, 1.0)
    post = np.array([[(1.0, 0.03, -0.4), (1.0, -0.021, -0.4), (1.0, -0.021, 0.4), (1.0, 0.03, 0.4)]])
    alone, *_ = picture(corners, mappings, mask)
    before, *_ = picture(np.concatenate((corners, post)), np.concatenate((mappings, mappings)), mask)
    changed = np.flatnonzero((alone != before).any(axis=0))
    assert changed[0] >= STRIP
    assert changed[-1] < 2 * STRIP
