"""Colours of a picture with a polygon number for each pixel, written as YUV 4:2:0 (BT.601, limited range).

A texture is a mask that mixes two colours: 256 x 256 texels and its smaller copies behind it, each texel (8 bits) with
its right, upper and upper right neighbour in one number. Coordinates are exact for each pixel; light is exact at the
ends of short strips and linear in between; where a texture changes slowly, every second pixel of a strip is sampled.
Pixels are painted LANES at a time, over the end of a strip: what lies behind it is painted next.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int32Array, SingleArray, Uint16Array, Uint32Array
from roboglot.kernels.compiled import kernel
from roboglot.kernels.lanes import FAR, LANES, MARGIN, equals, paint, paint_twice, sample, sample_between, tint
from roboglot.kernels.layouts import FIRST
from roboglot.kernels.raster import fill

STRIP = 128  # pixels: their samples fill whole lanes; strips begin at multiples, whatever stands before a surface
LEVEL = 64  # pixels of a strip of the floor or ceiling
SPARSE = 0.4  # texels between two pixels up to which every second pixel is sampled
BENT = 1.25  # most that the distance of one end of a strip is of the other's
BAND = 48  # rows that are drawn at a time: they fit into a processor's cache
SAMPLES, LINE = 160, 64  # samples along a strip; pixels that may be written behind a row's end
LEVELS = 8  # 256, 128 ... 2 texels per side
OFFSETS = np.concatenate(([0], np.cumsum([4 ** (8 - level) for level in range(LEVELS)]))).astype(np.int64)
S, F = np.int32, np.float32
ALL = S(LANES)
POINT = 65536.0  # 16 bits behind the point
WHITE = S(235)
BLACK, GREY = S(16 << 16), S((128 << 16) + (1 << 15))
HAZE = 0.045  # 1/m: how fast light fades with distance
DARKEST = 0.35


@kernel(inline="always", _nrt=False)
def _near(planes: FloatArray, k: int, x: float, y: float) -> float:
    """Return 1/z at a pixel."""
    return float(max(planes[k, 0] * x + planes[k, 1] * y + planes[k, 2], 1.0 / FAR))


@kernel(inline="always", _nrt=False)
def _place(planes: FloatArray, k: int, x: float, y: float, near: float) -> tuple[float, float]:
    """Return the texture coordinates at a pixel."""
    u = (planes[k, 3] * x + planes[k, 4] * y + planes[k, 5]) / near + planes[k, 6]
    v = (planes[k, 7] * x + planes[k, 8] * y + planes[k, 9]) / near + planes[k, 10]
    return u, v


@kernel(inline="always", _nrt=False)
def _level(texels: float) -> int:
    """Return the copy of the texture that has about one texel per pixel."""
    level = 0
    while texels > 1.0 and level < LEVELS - 1:
        texels *= 0.5
        level += 1
    return level


@kernel(inline="always", _nrt=False)
def _light(paints: SingleArray, k: int, near: float, gain: float) -> float:
    """Brightness of a surface 1 / ``near`` metres ahead."""
    fade = DARKEST + (1.0 - DARKEST) * near / (near + HAZE)
    return float(gain * paints[k, 6] * (1.0 + paints[k, 7] * (fade - 1.0)))


@kernel(inline="always", _nrt=False)
def _detail(planes: FloatArray, k: int, x: float, y: float) -> tuple[int, int]:
    """Return the level of the texture for a strip around a pixel, and how many pixels there are to a sample."""
    z = 1.0 / _near(planes, k, x, y)
    u = (planes[k, 3] * x + planes[k, 4] * y + planes[k, 5]) * z
    v = (planes[k, 7] * x + planes[k, 8] * y + planes[k, 9]) * z
    z *= 256.0
    du, dv = z * abs(planes[k, 3] - u * planes[k, 0]), z * abs(planes[k, 7] - v * planes[k, 0])
    across, along = du + dv, z * (abs(planes[k, 4] - u * planes[k, 1]) + abs(planes[k, 8] - v * planes[k, 1]))
    level = _level(max(0.5 * max(across, along), min(across, along)))  # between sharp and calm
    return level, 2 if max(du, dv) <= SPARSE * (1 << level) else 1


@kernel(inline="always", _nrt=False)
def _sample(
    samples: Int32Array, x0: int, x1: int, y: float, masks: Uint32Array, texture: int, planes: FloatArray, k: int
) -> int:
    """Sample a texture for the pixels from ``x0`` to ``x1``; return the pixels from one sample to the next."""
    level, step = _detail(planes, k, 0.5 * (x0 + x1), y)
    x = x0 - (step - 1) * (x0 & 1) + 0.5  # with a step of 2, samples are of even pixels
    count = x1 - x0 if step == 1 else ((x1 + 1) >> 1) - (x0 >> 1) + 1
    bits = 8 - level
    size = 256.0 * (1 << bits)
    near, nears = F(planes[k, 0] * x + planes[k, 1] * y + planes[k, 2]), F(step * planes[k, 0])
    across, acrosses = F(size * (planes[k, 3] * x + planes[k, 4] * y + planes[k, 5])), F(size * step * planes[k, 3])
    up, ups = F(size * (planes[k, 7] * x + planes[k, 8] * y + planes[k, 9])), F(size * step * planes[k, 7])
    column, row = S(np.int64(size * planes[k, 6])), S(np.int64(size * planes[k, 10]))
    base = texture * masks.shape[1] + OFFSETS[level]
    for at in range(0, count, LANES):
        if level:  # smaller copies are smooth enough
            sample(masks, base, near, nears, across, acrosses, up, ups, column, row, S(bits), samples, at)
        else:
            sample_between(masks, base, near, nears, across, acrosses, up, ups, column, row, S(bits), samples, at)
        near, across, up = F(near + F(LANES) * nears), F(across + F(LANES) * acrosses), F(up + F(LANES) * ups)
    return step


@kernel(inline="always", _nrt=False)
def _paint(
    line: ByteArray, x0: int, x1: int, samples: Int32Array, step: int, light: float, light_end: float,
    paints: SingleArray, k: int,
) -> None:  # fmt: skip
    """Paint the pixels from ``x0`` to ``x1``; ``step``: pixels from one sample to the next, 0 without a texture."""
    growth = POINT * (light_end - light) / (x1 - x0)
    base, base_step = S(S(POINT * light * paints[k, 0]) + BLACK), S(growth * paints[k, 0])
    mix, mix_step = S(POINT * light * paints[k, 3]), S(growth * paints[k, 3])
    if step == 0:
        mix, mix_step = S(0), S(0)
    if step < 2:
        for i in range(0, x1 - x0, LANES):
            paint(samples, i, base, base_step, mix, mix_step, WHITE, line, x0 + i)
            base, mix = S(base + S(ALL * base_step)), S(mix + S(ALL * mix_step))
        return
    lead = x0 & 1
    if lead:  # samples are of even pixels
        between = S(S(samples[0] + samples[1]) >> S(1))
        line[np.uintp(x0)] = np.uint8(min(S(S(base + S(mix * between)) >> S(16)), WHITE))
        base, mix = S(base + base_step), S(mix + mix_step)
    base_step, mix_step = S(S(2) * base_step), S(S(2) * mix_step)
    for i in range(0, (x1 - x0 - lead + 1) >> 1, LANES):
        paint_twice(samples, lead + i, base, base_step, mix, mix_step, WHITE, line, x0 + lead + 2 * i)
        base, mix = S(base + S(ALL * base_step)), S(mix + S(ALL * mix_step))


@kernel(inline="always", _nrt=False)
def _tint(
    blues: ByteArray, reds: ByteArray, x0: int, x1: int, samples: Int32Array, step: int, light: float,
    paints: SingleArray, k: int,
) -> None:  # fmt: skip
    """Colour the even pixels from ``x0`` to ``x1``; ``step`` as in ``_paint``."""
    bright = POINT * min(light, 1.0)
    blue, red = S(S(bright * paints[k, 1]) + GREY), S(S(bright * paints[k, 2]) + GREY)
    blue_mix, red_mix = S(bright * paints[k, 4]), S(bright * paints[k, 5])
    if step == 0:
        blue_mix, red_mix = S(0), S(0)
    first, every = (x0 + 1) >> 1, S(1 if step == 2 else 2)
    for i in range(0, ((x1 + 1) >> 1) - first, LANES):
        at = (x0 & 1) + i * every
        tint(samples, at, every, blue, blue_mix, blues, first + i)
        tint(samples, at, every, red, red_mix, reds, first + i)


@kernel(inline="always", _nrt=False)
def _cell(cells: ByteArray, frame: FloatArray, u: float, v: float) -> int:
    """Return the value of ``cells`` at a place of the floor."""
    column = int(min(max((u - frame[0]) * frame[2], 0.0), cells.shape[1] - 1.0))
    row = int(min(max((v - frame[1]) * frame[2], 0.0), cells.shape[0] - 1.0))
    return int(cells[row, column])


@kernel(inline="always", _nrt=False)
def _shadow(cells: ByteArray, frame: FloatArray, u: float, v: float) -> float:
    """Smooth brightness 0..1 of a place of the floor."""
    column = min(max((u - frame[0]) * frame[2] - 0.5, 0.0), cells.shape[1] - 1.001)
    row = min(max((v - frame[1]) * frame[2] - 0.5, 0.0), cells.shape[0] - 1.001)
    i, j = int(row), int(column)
    part, down = column - j, row - i
    upper = cells[i, j] + (float(cells[i, j + 1]) - cells[i, j]) * part
    lower = cells[i + 1, j] + (float(cells[i + 1, j + 1]) - cells[i + 1, j]) * part
    return float((upper + (lower - upper) * down) / 255.0)


@kernel(inline="always", _nrt=False)
def _run(seen: Uint16Array, y: int, x: int, limit: int) -> int:
    """Return the end of the run of equal numbers that begins at (x, y), at most ``limit``."""
    number, end, row = seen[y, x], x, y * seen.shape[1]
    while end < limit:
        more = equals(seen, row + end, number)
        end += more
        if more < 2 * LANES:
            break
    return min(end, limit)


@kernel(inline="always", _nrt=False)
def _shade_row(
    y: int,
    seen: Uint16Array,
    band_row: int,
    planes: FloatArray,
    sources: Int32Array,
    paints: SingleArray,
    textures: Int32Array,
    masks: Uint32Array,
    grounds: ByteArray,
    shadows: ByteArray,
    frame: FloatArray,
    gain: float,
    samples: Int32Array,
    line: ByteArray,
    blues: ByteArray,
    reds: ByteArray,
) -> None:
    """Colour one row into ``line``, ``blues`` and ``reds``."""
    width = seen.shape[1] - MARGIN
    middle, x = y + 0.5, 0
    while x < width:
        here = int(seen[band_row, x])
        end = _run(seen, band_row, x, min(width, x - x % STRIP + STRIP))
        if here < FIRST:
            end = min(end, x - x % LEVEL + LEVEL)
            half = 0.5 * (x + end)
            here = 0 if planes[0, 0] * half + planes[0, 1] * middle + planes[0, 2] > 0.0 else 1
        source = sources[here]
        near, near_end = _near(planes, here, x + 0.5, middle), _near(planes, here, end + 0.5, middle)
        while end > x + 16 and max(near, near_end) > BENT * min(near, near_end):
            end = (x + end) >> 1
            near_end = _near(planes, here, end + 0.5, middle)
        dark, dark_end = 1.0, 1.0
        if here == 0:
            u, v = _place(planes, here, x + 0.5, middle, near)
            u_end, v_end = _place(planes, here, end + 0.5, middle, near_end)
            ground = _cell(grounds, frame, u, v)
            while end > x + 1 and _cell(grounds, frame, u_end, v_end) != ground:
                end = (x + end) >> 1
                near_end = _near(planes, here, end + 0.5, middle)
                u_end, v_end = _place(planes, here, end + 0.5, middle, near_end)
            source += ground
            dark, dark_end = _shadow(shadows, frame, u, v), _shadow(shadows, frame, u_end, v_end)
        texture, step = textures[source], 0
        if texture >= 0:
            step = _sample(samples, x, end, middle, masks, texture, planes, here)
        light, light_end = dark * _light(paints, source, near, gain), dark_end * _light(paints, source, near_end, gain)
        _paint(line, x, end, samples, step, light, light_end, paints, source)
        if y & 1 == 0:
            _tint(blues, reds, x, end, samples, step, light, paints, source)
        x = end


@kernel(
    "void(float64[:,:,::1], int32[:,::1], int64, float64[:,::1], int32[::1], float32[:,::1], int32[::1],"
    " uint32[:,::1], uint8[:,::1], uint8[:,::1], float64[::1], float64, float64[:,::1], float32[:,::1], uint16[:,::1],"
    " int32[::1], uint8[:,::1], uint8[:,::1], uint8[:,::1], uint8[:,::1])",
    _nrt=False,
)
def shade(
    outlines: FloatArray,
    spans: Int32Array,
    last: int,
    planes: FloatArray,
    sources: Int32Array,
    paints: SingleArray,
    textures: Int32Array,
    masks: Uint32Array,
    grounds: ByteArray,
    shadows: ByteArray,
    frame: FloatArray,
    gain: float,
    ends: FloatArray,
    depth: SingleArray,
    seen: Uint16Array,
    samples: Int32Array,
    lines: ByteArray,
    luma: ByteArray,
    blue: ByteArray,
    red: ByteArray,
) -> None:
    """Draw and colour the polygons up to ``last`` that ``raster.project`` found. Planes 0 and 1: floor and ceiling.

    ``sources[k]`` is the row of ``paints`` and ``textures`` (-1: none) of the plane k; for the floor it is the first
    of a row per ground, and ``grounds`` says which ground a cell has. ``shadows``: the floor's brightness per cell.
    ``frame``: texture coordinates of the cells' corner, cells per texture. A paint: Y, U, V of one colour; steps to the
    other per mask unit; light; whether distance dims it.

    Scratch space: ``ends``, ``depth`` and ``seen`` of as many rows as are drawn at a time, an even number, the last two
    MARGIN longer than a row; ``samples`` (SAMPLES); ``lines`` (3, LINE more than a row).
    """
    height, width = luma.shape
    for top in range(0, height, depth.shape[0]):
        rows = min(depth.shape[0], height - top)
        fill(outlines, spans, planes, last, top, rows, ends, depth, seen)
        for row in range(rows):
            y = top + row
            inside = y < height - 2  # elsewhere the end of a row is not followed by one that is painted later
            line = luma[y] if inside else lines[0]
            blues, reds = blue[y >> 1] if inside else lines[1], red[y >> 1] if inside else lines[2]
            _shade_row(
                y, seen, row, planes, sources, paints, textures, masks, grounds, shadows, frame, gain, samples,
                line, blues, reds,
            )  # fmt: skip
            if not inside:
                for x in range(width):
                    luma[y, x] = line[x]
                    blue[y >> 1, x >> 1], red[y >> 1, x >> 1] = blues[x >> 1], reds[x >> 1]
