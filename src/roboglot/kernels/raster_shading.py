"""The colours of a picture whose polygons are known pixel by pixel, written as YUV 4:2:0 (BT.601, limited range).

A texture is a mask that mixes two colours: 256 x 256 texels and its smaller copies behind it, each texel (8 bits) with
its right, upper and upper right neighbour in one number. Coordinates, light and
distance are exact at the ends of short strips and linear in between.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from roboglot.kernels.raster import FIRST

STRIP = 64  # pixels
BENT = 0.04  # how much the distance may change within a textured strip
BLOCK = 32
LEVELS = 8  # 256, 128 ... 2 texels a side
OFFSETS = np.concatenate(([0], np.cumsum([4 ** (8 - level) for level in range(LEVELS)]))).astype(np.int64)
ONE = 4294967296.0  # a texture's width in whole numbers: its fraction fills 32 bits
WHITE: Any = 235
HALF = (128 << 16) + (1 << 15)
FAR = 80.0  # m
HAZE = 0.045  # 1/m: how fast light fades with the distance from the eye
DARKEST = 0.35


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _at(planes: Any, k: int, x: float, y: float) -> tuple[Any, Any, Any]:
    """Distance ahead and texture coordinates at a pixel."""
    near = planes[k, 0] * x + planes[k, 1] * y + planes[k, 2]
    z = 1.0 / max(near, 1.0 / FAR)
    u = (planes[k, 3] * x + planes[k, 4] * y + planes[k, 5]) * z + planes[k, 6]
    v = (planes[k, 7] * x + planes[k, 8] * y + planes[k, 9]) * z + planes[k, 10]
    return z, u, v


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _texels(planes: Any, k: int, z: float, u: float, v: float) -> Any:
    """How many of a texture's 256 texels lie between two pixels there, between sharp and calm."""
    across = abs(planes[k, 3] - (u - planes[k, 6]) * planes[k, 0]) + abs(
        planes[k, 7] - (v - planes[k, 10]) * planes[k, 0]
    )
    along = abs(planes[k, 4] - (u - planes[k, 6]) * planes[k, 1]) + abs(
        planes[k, 8] - (v - planes[k, 10]) * planes[k, 1]
    )
    return 256.0 * z * max(0.5 * max(across, along), min(across, along))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _level(texels: float) -> Any:
    """Which copy of the texture has about one texel per pixel."""
    level = 0
    while texels > 1.0 and level < LEVELS - 1:
        texels *= 0.5
        level += 1
    return level


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _light(paints: Any, k: int, z: float, gain: float) -> Any:
    """Brightness of a surface z metres ahead."""
    fade = DARKEST + (1.0 - DARKEST) / (1.0 + HAZE * z)
    return gain * paints[k, 6] * (1.0 + paints[k, 7] * (fade - 1.0))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _paint_flat(luma: Any, row: int, x0: int, x1: int, light: float, light_end: float, paints: Any, k: int) -> None:
    value = np.int64(light * paints[k, 0] * 65536.0) + (16 << 16)
    step = np.int64((light_end - light) / (x1 - x0) * paints[k, 0] * 65536.0)
    for x in range(x0, x1):
        luma[np.uintp(row), np.uintp(x)] = np.uint8(min(value >> 16, WHITE))
        value += step


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _smooth(masks: Any, texture: int, u: int, v: int) -> Any:
    """The mask 0..255 at (u, v) of the finest copy, mixed of four texels."""
    place = (((v >> 24) & 255) << 8) + ((u >> 24) & 255)
    four = np.int64(masks[np.uintp(texture), np.uintp(place)])
    part_u, part_v = (u >> 16) & 255, (v >> 16) & 255
    two = (four & 0x00FF00FF) * (256 - part_u) + ((four >> 8) & 0x00FF00FF) * part_u
    return ((two & 0xFFFF) * (256 - part_v) + (two >> 16) * part_v) >> 16


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _paint_textured(
    luma: Any, row: int, x0: int, x1: int, masks: Any, texture: int, texels: float, level: int, uv: Any, light: float,
    light_end: float, paints: Any, k: int,
) -> None:  # fmt: skip
    """``uv``: u and v at x0 and their steps per pixel, in textures. Whole numbers only: these are the busiest loops."""
    u, v, du, dv = np.int64(uv[0] * ONE), np.int64(uv[1] * ONE), np.int64(uv[2] * ONE), np.int64(uv[3] * ONE)
    base, mix = np.int64(light * paints[k, 0] * 65536.0) + (16 << 16), np.int64(light * paints[k, 3] * 65536.0)
    growth = (light_end - light) / (x1 - x0) * 65536.0
    base_step, mix_step = np.int64(growth * paints[k, 0]), np.int64(growth * paints[k, 3])
    if level > 0:  # far away, where copies are smooth enough
        bits, start = 8 - level, OFFSETS[level]
        mask, shift = (1 << bits) - 1, 32 - bits
        for x in range(x0, x1):
            place = start + (((v >> shift) & mask) << bits) + ((u >> shift) & mask)
            value = np.int64(masks[np.uintp(texture), np.uintp(place)]) & 255
            luma[np.uintp(row), np.uintp(x)] = np.uint8(min((base + mix * value) >> 16, WHITE))
            u, v, base, mix = u + du, v + dv, base + base_step, mix + mix_step
    elif texels > 0.5:
        for x in range(x0, x1):
            luma[np.uintp(row), np.uintp(x)] = np.uint8(min((base + mix * _smooth(masks, texture, u, v)) >> 16, WHITE))
            u, v, base, mix = u + du, v + dv, base + base_step, mix + mix_step
    else:  # close by: every second pixel, and those between from their neighbours
        value = _smooth(masks, texture, u, v)
        for pair in range((x1 - x0) >> 1):
            u, v = u + 2 * du, v + 2 * dv
            following = _smooth(masks, texture, u, v)
            x = x0 + 2 * pair
            luma[np.uintp(row), np.uintp(x)] = np.uint8(min((base + mix * value) >> 16, WHITE))
            base, mix = base + base_step, mix + mix_step
            luma[np.uintp(row), np.uintp(x + 1)] = np.uint8(min((base + mix * ((value + following) >> 1)) >> 16, WHITE))
            base, mix = base + base_step, mix + mix_step
            value = following
        if (x1 - x0) & 1:
            luma[np.uintp(row), np.uintp(x1 - 1)] = np.uint8(min((base + mix * value) >> 16, WHITE))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _paint_chroma(
    blue: Any, red: Any, row: int, x0: int, x1: int, masks: Any, texture: int, level: int, uv: Any, light: float,
    paints: Any, k: int,
) -> None:  # fmt: skip
    """Every second pixel of an even row; ``level`` below 0: no texture."""
    bright = 65536.0 * min(light, 1.0)
    first, last = (x0 + 1) >> 1, (x1 + 1) >> 1
    u_base, v_base = np.int64(paints[k, 1] * bright) + HALF, np.int64(paints[k, 2] * bright) + HALF
    if level < 0:
        for x in range(first, last):
            blue[np.uintp(row), np.uintp(x)] = np.uint8(u_base >> 16)
            red[np.uintp(row), np.uintp(x)] = np.uint8(v_base >> 16)
        return
    u_mix, v_mix = np.int64(paints[k, 4] * bright), np.int64(paints[k, 5] * bright)
    bits, start = 8 - level, OFFSETS[level]
    mask, shift = (1 << bits) - 1, 32 - bits
    lead = 2 * first - x0
    u, v = np.int64((uv[0] + lead * uv[2]) * ONE), np.int64((uv[1] + lead * uv[3]) * ONE)
    du, dv = np.int64(2.0 * uv[2] * ONE), np.int64(2.0 * uv[3] * ONE)
    for x in range(first, last):
        place = start + (((v >> shift) & mask) << bits) + ((u >> shift) & mask)
        value = np.int64(masks[np.uintp(texture), np.uintp(place)]) & 255
        blue[np.uintp(row), np.uintp(x)] = np.uint8((u_base + u_mix * value) >> 16)
        red[np.uintp(row), np.uintp(x)] = np.uint8((v_base + v_mix * value) >> 16)
        u += du
        v += dv


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _cell(cells: Any, frame: Any, u: float, v: float) -> Any:
    """What ``cells`` says at a place of the floor."""
    column = int(min(max((u - frame[0]) * frame[2], 0.0), cells.shape[1] - 1.0))
    row = int(min(max((v - frame[1]) * frame[2], 0.0), cells.shape[0] - 1.0))
    return int(cells[row, column])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _shadow(cells: Any, frame: Any, u: float, v: float) -> Any:
    """Smooth brightness 0..1 of a place of the floor."""
    column = min(max((u - frame[0]) * frame[2] - 0.5, 0.0), cells.shape[1] - 1.001)
    row = min(max((v - frame[1]) * frame[2] - 0.5, 0.0), cells.shape[0] - 1.001)
    i, j = int(row), int(column)
    part, down = column - j, row - i
    upper = cells[i, j] + (float(cells[i, j + 1]) - cells[i, j]) * part
    lower = cells[i + 1, j] + (float(cells[i + 1, j + 1]) - cells[i + 1, j]) * part
    return (upper + (lower - upper) * down) / 255.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _run(seen: Any, y: int, x: int, limit: int) -> Any:
    """Where the run of equal numbers that begins at (x, y) ends, at ``limit`` if not before."""
    number, end = seen[y, x], x
    while end + BLOCK <= limit:
        same = 0
        for i in range(BLOCK):  # without a way out of the loop it becomes a few wide instructions
            same += seen[np.uintp(y), np.uintp(end + i)] == number
        if same < BLOCK:
            break
        end += BLOCK
    while end < limit and seen[np.uintp(y), np.uintp(end)] == number:
        end += 1
    return end


@njit(
    "void(uint16[:,::1], float64[:,::1], int32[::1], float32[:,::1], int32[::1], uint32[:,::1], uint8[:,::1],"
    " uint8[:,::1], float64[::1], float64, uint8[:,::1], uint8[:,::1], uint8[:,::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def shade(
    seen: Any,
    planes: Any,
    sources: Any,
    paints: Any,
    textures: Any,
    masks: Any,
    grounds: Any,
    shadows: Any,
    frame: Any,
    gain: float,
    luma: Any,
    blue: Any,
    red: Any,
) -> None:
    """Colour what ``raster.draw`` found. Planes 0 and 1 are floor and ceiling.

    ``sources[k]`` is the row of ``paints`` and ``textures`` (-1: none) of the plane k; for the floor it is the first
    of a row per ground, and ``grounds`` says which ground a cell has. ``shadows``: the floor's brightness per cell.
    ``frame``: texture coordinates of the cells' corner, cells per texture. A paint: Y, U, V of one colour; steps to the
    other per mask unit; light; whether distance dims it.
    """
    height, width = seen.shape
    uv = np.empty(4)
    for y in range(height):
        middle = y + 0.5
        x, last = 0, -1
        z_end, u_end, v_end = 0.0, 0.0, 0.0
        while x < width:
            here = int(seen[y, x])
            end = _run(seen, y, x, min(width, x + STRIP))
            if here < FIRST:
                half = 0.5 * (x + end)
                here = 0 if planes[0, 0] * half + planes[0, 1] * middle + planes[0, 2] > 0.0 else 1
            source = sources[here]
            z, u, v = z_end, u_end, v_end
            if here != last:
                z, u, v = _at(planes, here, x + 0.5, middle)
            z_end, u_end, v_end = _at(planes, here, end + 0.5, middle)
            while textures[source] >= 0 and end > x + 16 and abs(z_end - z) > BENT * min(z, z_end):
                end = (x + end) >> 1
                z_end, u_end, v_end = _at(planes, here, end + 0.5, middle)
            dark, dark_end = 1.0, 1.0
            if here == 0:
                ground = _cell(grounds, frame, u, v)
                while end > x + 1 and _cell(grounds, frame, u_end, v_end) != ground:
                    end = (x + end) >> 1
                    z_end, u_end, v_end = _at(planes, here, end + 0.5, middle)
                source += ground
                dark, dark_end = _shadow(shadows, frame, u, v), _shadow(shadows, frame, u_end, v_end)
            last = here
            texture = textures[source]
            light, light_end = _light(paints, source, z, gain) * dark, _light(paints, source, z_end, gain) * dark_end
            level = -1
            if texture >= 0:
                texels = _texels(planes, here, z, u, v)
                level = _level(texels)
                uv[0], uv[1], uv[2], uv[3] = u, v, (u_end - u) / (end - x), (v_end - v) / (end - x)
                _paint_textured(luma, y, x, end, masks, texture, texels, level, uv, light, light_end, paints, source)
            else:
                _paint_flat(luma, y, x, end, light, light_end, paints, source)
            if y & 1 == 0:
                _paint_chroma(blue, red, y >> 1, x, end, masks, texture, level, uv, light, paints, source)
            x = end
