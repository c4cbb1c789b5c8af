"""Colours of a picture with a polygon number for each pixel, written as YUV 4:2:0 (BT.601, limited range).

A texture is a mask that mixes two colours: 256 x 256 texels and its smaller copies behind it, each texel (8 bits) with
its right, upper and upper right neighbour in one number. Coordinates, light and
distance are exact at the ends of short strips and linear in between.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int32Array, SingleArray, Uint16Array, Uint32Array
from roboglot.kernels.compiled import kernel
from roboglot.kernels.layouts import FIRST

STRIP = 64  # pixels
BENT = 0.04  # relative change of distance within a textured strip
BLOCK = 32
LEVELS = 8  # 256, 128 ... 2 texels per side
OFFSETS = np.concatenate(([0], np.cumsum([4 ** (8 - level) for level in range(LEVELS)]))).astype(np.int64)
ONE = 4294967296.0  # a texture's width as an integer: its fraction fills 32 bits
U, S = np.uint32, np.int32
WHITE = S(235)
HALF = S((128 << 16) + (1 << 15))
PAIR = U(0x00FF00FF)
FAR = 80.0  # m
HAZE = 0.045  # 1/m: how fast light fades with distance
DARKEST = 0.35


@kernel(inline="always")
def _at(planes: FloatArray, k: int, x: float, y: float) -> tuple[float, float, float]:
    """Distance ahead and texture coordinates at a pixel."""
    near = planes[k, 0] * x + planes[k, 1] * y + planes[k, 2]
    z = 1.0 / max(near, 1.0 / FAR)
    u = (planes[k, 3] * x + planes[k, 4] * y + planes[k, 5]) * z + planes[k, 6]
    v = (planes[k, 7] * x + planes[k, 8] * y + planes[k, 9]) * z + planes[k, 10]
    return z, u, v


@kernel(inline="always")
def _texels(planes: FloatArray, k: int, z: float, u: float, v: float) -> float:
    """Return how many of a texture's 256 texels lie between two pixels there, between sharp and calm."""
    across = abs(planes[k, 3] - (u - planes[k, 6]) * planes[k, 0]) + abs(
        planes[k, 7] - (v - planes[k, 10]) * planes[k, 0]
    )
    along = abs(planes[k, 4] - (u - planes[k, 6]) * planes[k, 1]) + abs(
        planes[k, 8] - (v - planes[k, 10]) * planes[k, 1]
    )
    return float(256.0 * z * max(0.5 * max(across, along), min(across, along)))


@kernel(inline="always")
def _level(texels: float) -> int:
    """Return the copy of the texture that has about one texel per pixel."""
    level = 0
    while texels > 1.0 and level < LEVELS - 1:
        texels *= 0.5
        level += 1
    return level


@kernel(inline="always")
def _light(paints: SingleArray, k: int, z: float, gain: float) -> float:
    """Brightness of a surface z metres ahead."""
    fade = DARKEST + (1.0 - DARKEST) / (1.0 + HAZE * z)
    return float(gain * paints[k, 6] * (1.0 + paints[k, 7] * (fade - 1.0)))


@kernel(inline="always")
def _paint_flat(
    luma: ByteArray, row: int, x0: int, x1: int, light: float, light_end: float, paints: SingleArray, k: int
) -> None:
    count, line = x1 - x0, luma[np.uintp(row)]
    value, step = (
        S(light * paints[k, 0] * 65536.0) + S(16 << 16),
        S((light_end - light) / count * paints[k, 0] * 65536.0),
    )
    for i in range(count):
        line[np.uintp(x0 + i)] = np.uint8(min(S(S(value + S(S(i) * step)) >> S(16)), WHITE))


@kernel(inline="always")
def _fetch(
    texels: Uint32Array, places: Uint32Array, count: int, masks: Uint32Array, texture: int, level: int, uv: FloatArray
) -> None:
    """The texels of ``count`` pixels. Where they lie is worked out first: without the look-up it is wide arithmetic."""
    u, v = U(np.int64(uv[0] * ONE)), U(np.int64(uv[1] * ONE))
    du, dv = U(np.int64(uv[2] * ONE)), U(np.int64(uv[3] * ONE))
    bits, shift, start = U(8 - level), U(24 + level), U(OFFSETS[level])
    for i in range(count):
        column, row = U(U(u + U(U(i) * du)) >> shift), U(U(v + U(U(i) * dv)) >> shift)
        places[np.uintp(i)] = U(U(start + U(row << bits)) + column)
    for i in range(count):
        texels[np.uintp(i)] = masks[np.uintp(texture), np.uintp(places[np.uintp(i)])]


@kernel(inline="always")
def _paint_textured(
    luma: ByteArray, row: int, x0: int, x1: int, texels: Uint32Array, level: int, uv: FloatArray,
    light: float, light_end: float, paints: SingleArray, k: int,
) -> None:  # fmt: skip
    """``texels`` were fetched; ``uv``: u and v at x0 and their steps per pixel, in textures.

    Numba widens all whole numbers to 64 bits unless every single result is said to have 32; then these, the busiest
    loops, become wide instructions.
    """
    count, line = x1 - x0, luma[np.uintp(row)]
    base, mix = S(light * paints[k, 0] * 65536.0) + S(16 << 16), S(light * paints[k, 3] * 65536.0)
    growth = (light_end - light) / count * 65536.0
    base_step, mix_step = S(growth * paints[k, 0]), S(growth * paints[k, 3])
    if level > 0:  # far away, where the smaller copies are smooth enough
        for i in range(count):
            mask = S(texels[np.uintp(i)] & U(255))
            value = S(S(S(base + S(S(i) * base_step)) + S(S(mix + S(S(i) * mix_step)) * mask)) >> S(16))
            line[np.uintp(x0 + i)] = np.uint8(min(value, WHITE))
        return
    u, v = U(np.int64(uv[0] * ONE)), U(np.int64(uv[1] * ONE))
    du, dv = U(np.int64(uv[2] * ONE)), U(np.int64(uv[3] * ONE))
    for i in range(count):  # bilinear
        four = texels[np.uintp(i)]
        right, up = U(U(U(u + U(U(i) * du)) >> U(16)) & U(255)), U(U(U(v + U(U(i) * dv)) >> U(16)) & U(255))
        two = U(U(U(four & PAIR) * U(U(256) - right)) + U(U(U(four >> U(8)) & PAIR) * right))
        mask = S(U(U(U(two & U(0xFFFF)) * U(U(256) - up)) + U(U(two >> U(16)) * up)) >> U(16))
        value = S(S(S(base + S(S(i) * base_step)) + S(S(mix + S(S(i) * mix_step)) * mask)) >> S(16))
        line[np.uintp(x0 + i)] = np.uint8(min(value, WHITE))


@kernel(inline="always")
def _paint_chroma(
    blue: ByteArray,
    red: ByteArray,
    row: int,
    x0: int,
    x1: int,
    texels: Uint32Array,
    level: int,
    light: float,
    paints: SingleArray,
    k: int,
) -> None:
    """Every second pixel of an even row; ``level`` below 0: no texture."""
    bright = 65536.0 * min(light, 1.0)
    first, last = (x0 + 1) >> 1, (x1 + 1) >> 1
    u_base, v_base = S(paints[k, 1] * bright) + HALF, S(paints[k, 2] * bright) + HALF
    if level < 0:
        for x in range(first, last):
            blue[np.uintp(row), np.uintp(x)] = np.uint8(u_base >> 16)
            red[np.uintp(row), np.uintp(x)] = np.uint8(v_base >> 16)
        return
    u_mix, v_mix = S(paints[k, 4] * bright), S(paints[k, 5] * bright)
    blues, reds, lead = blue[np.uintp(row)], red[np.uintp(row)], 2 * first - x0
    for i in range(last - first):
        mask = S(texels[np.uintp(lead + 2 * i)] & U(255))
        blues[np.uintp(first + i)] = np.uint8(S(u_base + S(u_mix * mask)) >> S(16))
        reds[np.uintp(first + i)] = np.uint8(S(v_base + S(v_mix * mask)) >> S(16))


@kernel(inline="always")
def _cell(cells: ByteArray, frame: FloatArray, u: float, v: float) -> int:
    """Return the value of ``cells`` at a place of the floor."""
    column = int(min(max((u - frame[0]) * frame[2], 0.0), cells.shape[1] - 1.0))
    row = int(min(max((v - frame[1]) * frame[2], 0.0), cells.shape[0] - 1.0))
    return int(cells[row, column])


@kernel(inline="always")
def _shadow(cells: ByteArray, frame: FloatArray, u: float, v: float) -> float:
    """Smooth brightness 0..1 of a place of the floor."""
    column = min(max((u - frame[0]) * frame[2] - 0.5, 0.0), cells.shape[1] - 1.001)
    row = min(max((v - frame[1]) * frame[2] - 0.5, 0.0), cells.shape[0] - 1.001)
    i, j = int(row), int(column)
    part, down = column - j, row - i
    upper = cells[i, j] + (float(cells[i, j + 1]) - cells[i, j]) * part
    lower = cells[i + 1, j] + (float(cells[i + 1, j + 1]) - cells[i + 1, j]) * part
    return float((upper + (lower - upper) * down) / 255.0)


@kernel(inline="always")
def _run(seen: Uint16Array, y: int, x: int, limit: int) -> int:
    """Return the end of the run of equal numbers that begins at (x, y), at most ``limit``."""
    number, end = seen[y, x], x
    while end + BLOCK <= limit:
        other = np.uint16(0)
        for i in range(BLOCK):  # a loop without an exit compiles to a few vector instructions
            other |= np.uint16(seen[np.uintp(y), np.uintp(end + i)] ^ number)
        if other:
            break
        end += BLOCK
    while end < limit and seen[np.uintp(y), np.uintp(end)] == number:
        end += 1
    return end


@kernel(
    "void(uint16[:,::1], float64[:,::1], int32[::1], float32[:,::1], int32[::1], uint32[:,::1], uint8[:,::1],"
    " uint8[:,::1], float64[::1], float64, uint8[:,::1], uint8[:,::1], uint8[:,::1])",
)
def shade(
    seen: Uint16Array,
    planes: FloatArray,
    sources: Int32Array,
    paints: SingleArray,
    textures: Int32Array,
    masks: Uint32Array,
    grounds: ByteArray,
    shadows: ByteArray,
    frame: FloatArray,
    gain: float,
    luma: ByteArray,
    blue: ByteArray,
    red: ByteArray,
) -> None:
    """Colour the polygons that ``raster.draw`` found. Planes 0 and 1 are floor and ceiling.

    ``sources[k]`` is the row of ``paints`` and ``textures`` (-1: none) of the plane k; for the floor it is the first
    of a row per ground, and ``grounds`` says which ground a cell has. ``shadows``: the floor's brightness per cell.
    ``frame``: texture coordinates of the cells' corner, cells per texture. A paint: Y, U, V of one colour; steps to the
    other per mask unit; light; whether distance dims it.
    """
    height, width = seen.shape
    uv = np.empty(4)
    places, texels = np.empty(STRIP, np.uint32), np.empty(STRIP, np.uint32)
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
                level = _level(_texels(planes, here, z, u, v))
                uv[0], uv[1], uv[2], uv[3] = u, v, (u_end - u) / (end - x), (v_end - v) / (end - x)
                _fetch(texels, places, end - x, masks, texture, level, uv)
                _paint_textured(luma, y, x, end, texels, level, uv, light, light_end, paints, source)
            else:
                _paint_flat(luma, y, x, end, light, light_end, paints, source)
            if y & 1 == 0:
                _paint_chroma(blue, red, y >> 1, x, end, texels, level, light, paints, source)
            x = end
