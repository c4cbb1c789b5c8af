"""Sixteen pixels at once: what kernels do with whole vectors, written as LLVM's own instructions.

Numba widens whole numbers to 64 bits, and LLVM does not turn look-ups into vectors: loops over pixels in Python took
four times as long. Each function here is one step of ``raster`` or ``raster_shading`` for LANES neighbours; LLVM makes
of it whatever the processor has. Numbers are 32 bits and wrap; fractions of brightness and colour have 16 bits behind
the point, fractions of a texel 8.
"""

from __future__ import annotations

from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext as Context
from numba.core.types import Type
from numba.core.typing import Signature
from numba.extending import intrinsic

LANES = 16
MARGIN = 2 * LANES  # elements that rows have behind their end, because vectors reach beyond it
BYTE, SHORT, INT, LONG, BIT, FLOAT = (*(ir.IntType(bits) for bits in (8, 16, 32, 64, 1)), ir.FloatType())
INTS, LONGS, BITS, FLOATS = (ir.VectorType(kind, LANES) for kind in (INT, LONG, BIT, FLOAT))
POINTERS = ir.VectorType(ir.PointerType(INT), LANES)
FAR = 80.0  # m beyond which distances are not told apart
Values = tuple[ir.Value, ...]
Lowered = tuple[Signature, Callable[[Context, ir.IRBuilder, Signature, Values], ir.Value]]


class Lanes:
    """A vector of numbers while a kernel is compiled: arithmetic on it writes instructions."""

    __slots__ = ("_builder", "value")

    def __init__(self, builder: ir.IRBuilder, value: ir.Value) -> None:
        self._builder, self.value = builder, value

    def __add__(self, other: Lanes) -> Lanes:
        add = self._builder.fadd if self._is_float else self._builder.add
        return Lanes(self._builder, add(self.value, other.value))

    def __sub__(self, other: Lanes) -> Lanes:
        return Lanes(self._builder, self._builder.sub(self.value, other.value))

    def __mul__(self, other: Lanes) -> Lanes:
        multiply = self._builder.fmul if self._is_float else self._builder.mul
        return Lanes(self._builder, multiply(self.value, other.value))

    def __and__(self, other: Lanes | int) -> Lanes:
        return Lanes(self._builder, self._builder.and_(self.value, self._like(other)))

    def __rshift__(self, bits: int) -> Lanes:
        """Shift in zeros."""
        return Lanes(self._builder, self._builder.lshr(self.value, self._like(bits)))

    def __lshift__(self, bits: Lanes) -> Lanes:
        return Lanes(self._builder, self._builder.shl(self.value, bits.value))

    def complement(self, whole: int) -> Lanes:
        """Return ``whole`` less these numbers."""
        return Lanes(self._builder, self._builder.sub(self._like(whole), self.value))

    def rounded(self) -> Lanes:
        """Return the integer parts (floor) of signed 16.16 fixed-point numbers."""
        return Lanes(self._builder, self._builder.ashr(self.value, self._like(16)))

    def at_most(self, limit: Lanes) -> Lanes:
        """Return the lesser numbers of both."""
        below = self._builder.icmp_signed("<", self.value, limit.value)
        return Lanes(self._builder, self._builder.select(below, self.value, limit.value))

    def inverse(self, least: float) -> Lanes:
        """Return 1 / each, or 1 / ``least`` for those below it."""
        builder, limit = self._builder, self._like(least)
        number = builder.select(builder.fcmp_ordered(">", self.value, limit), self.value, limit)
        return Lanes(builder, builder.fdiv(self._like(1.0), number))

    def whole(self) -> Lanes:
        """Return floating-point numbers truncated to integers."""
        return Lanes(self._builder, self._builder.fptosi(self.value, INTS))

    def bytes(self) -> ir.Value:
        """Return the lowest 8 bits of each."""
        return self._builder.trunc(self.value, ir.VectorType(BYTE, LANES))

    @property
    def _is_float(self) -> bool:
        """True for floating-point numbers."""
        return bool(self.value.type == FLOATS)

    def _like(self, other: Lanes | float) -> ir.Value:
        return other.value if isinstance(other, Lanes) else ir.Constant(self.value.type, [other] * LANES)


def _all(builder: ir.IRBuilder, number: ir.Value) -> Lanes:
    """Return ``number`` in every lane."""
    kind = ir.VectorType(number.type, LANES)
    blank = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(blank, number, ir.Constant(INT, 0))
    return Lanes(builder, builder.shuffle_vector(first, blank, ir.Constant(INTS, [0] * LANES)))


def _ramp(builder: ir.IRBuilder, first: ir.Value, step: ir.Value) -> Lanes:
    """Return ``first``, and in each further lane ``step`` more."""
    numbers = Lanes(builder, ir.Constant(ir.VectorType(first.type, LANES), list(range(LANES))))
    return _all(builder, first) + _all(builder, step) * numbers


class _Row:
    """A contiguous array while a kernel is compiled; its elements count from its first, whatever its shape."""

    def __init__(self, context: Context, builder: ir.IRBuilder, kind: Type, array: ir.Value) -> None:
        self._builder, self._start = builder, context.make_array(kind)(context, builder, array).data

    def load(self, at: ir.Value, count: int = LANES, kind: ir.Type = INT) -> ir.Value:
        """Return ``count`` numbers of this kind from element ``at`` on."""
        vector = ir.VectorType(kind, count)
        place = self._builder.bitcast(self._builder.gep(self._start, [at]), ir.PointerType(vector))
        return self._builder.load(place, align=2 if kind == SHORT else 4)

    def store(self, at: ir.Value, vector: ir.Value) -> None:
        """Write a vector from element ``at`` on."""
        place = self._builder.bitcast(self._builder.gep(self._start, [at]), ir.PointerType(vector.type))
        kind = vector.type.element
        self._builder.store(vector, place, align=4 if kind == FLOAT else kind.width // 8)

    def look_up(self, base: ir.Value, places: Lanes) -> Lanes:
        """Return the numbers of 32 bits at ``base`` + ``places``, which are not negative."""
        builder = self._builder
        pointers = builder.gep(builder.gep(self._start, [base]), [places.value], source_etype=INT)
        pointers.type = POINTERS  # one for each lane, of which llvmlite does not know
        kind = ir.FunctionType(INTS, [POINTERS, INT, BITS, INTS])
        gather = cgutils.get_or_insert_function(builder.module, kind, f"llvm.masked.gather.v{LANES}i32.v{LANES}p0")
        blank = ir.Constant(INTS, ir.Undefined)
        found = builder.call(gather, [pointers, ir.Constant(INT, 4), ir.Constant(BITS, [1] * LANES), blank])
        return Lanes(builder, found)


@intrinsic
def cover(
    _typing: Context, depth: Type, seen: Type, at: Type, near: Type, step: Type, number: Type, count: Type
) -> Lowered:
    """Write ``number`` to ``seen`` where it is nearer than ``depth`` (1/m), for the first ``count`` of LANES pixels."""

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        _, _, at, near, step, number, count = values
        depths, numbers = (_Row(context, b, signature.args[i], values[i]) for i in (0, 1))
        here, before = _ramp(b, near, step).value, depths.load(at, kind=FLOAT)
        within = b.icmp_signed("<", ir.Constant(INTS, list(range(LANES))), _all(b, count).value)
        nearer = b.and_(b.fcmp_ordered(">", here, before), within)
        depths.store(at, b.select(nearer, here, before))
        numbers.store(at, b.select(nearer, _all(b, number).value, numbers.load(at, kind=SHORT)))
        return context.get_dummy_value()

    return types.void(depth, seen, at, near, step, number, count), write


@intrinsic
def equals(_typing: Context, seen: Type, at: Type, number: Type) -> Lowered:
    """Return how many of 2 LANES elements of ``seen`` from ``at`` on equal ``number`` before the first other one."""

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        _, at, number = values
        row = _Row(context, b, signature.args[0], values[0])
        wide = ir.VectorType(SHORT, 2 * LANES)
        blank = ir.Constant(wide, ir.Undefined)
        first = b.insert_element(blank, number, ir.Constant(INT, 0))
        same = b.shuffle_vector(first, blank, ir.Constant(ir.VectorType(INT, 2 * LANES), [0] * (2 * LANES)))
        others = b.icmp_unsigned("!=", row.load(at, 2 * LANES, SHORT), same)
        return b.zext(b.cttz(b.bitcast(others, INT), ir.Constant(BIT, 0)), LONG)

    return types.int64(seen, at, number), write


@intrinsic
def sample(
    _typing: Context, texels: Type, base: Type, near: Type, nears: Type, across: Type, acrosses: Type, up: Type,
    ups: Type, column: Type, row: Type, bits: Type, samples: Type, at: Type,
) -> Lowered:  # fmt: skip
    """Write LANES samples of a texture, 0 to 255, to ``samples`` from ``at`` on, each of one texel.

    ``texels``, from ``base`` on: each with its right, upper and upper right neighbour in its four bytes, 2 ** ``bits``
    in a row. ``near`` is 1/z (1/m), ``across`` / ``near`` + ``column`` a column and ``up`` / ``near`` + ``row`` a row,
    in 256ths of a texel; ``nears``, ``acrosses`` and ``ups`` are their steps from lane to lane.
    """

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        found, _, _ = _texels(context, b, signature, values)
        _Row(context, b, signature.args[11], values[11]).store(values[12], (found & 0xFF).value)
        return context.get_dummy_value()

    arguments = (texels, base, near, nears, across, acrosses, up, ups, column, row, bits, samples, at)
    return types.void(*arguments), write


@intrinsic
def sample_between(
    _typing: Context, texels: Type, base: Type, near: Type, nears: Type, across: Type, acrosses: Type, up: Type,
    ups: Type, column: Type, row: Type, bits: Type, samples: Type, at: Type,
) -> Lowered:  # fmt: skip
    """Do what ``sample`` does with texels mixed with their neighbours."""

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        four, u, v = _texels(context, b, signature, values)
        right, above = u & 0xFF, v & 0xFF
        two = (four & 0xFF00FF) * right.complement(256) + ((four >> 8) & 0xFF00FF) * right
        mixed = ((two & 0xFFFF) * above.complement(256) + (two >> 16) * above) >> 16
        _Row(context, b, signature.args[11], values[11]).store(values[12], mixed.value)
        return context.get_dummy_value()

    arguments = (texels, base, near, nears, across, acrosses, up, ups, column, row, bits, samples, at)
    return types.void(*arguments), write


def _texels(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> tuple[Lanes, Lanes, Lanes]:
    """Return texels with their neighbours, and the places in them, for the arguments of ``sample``."""
    texels, base, near, nears, across, acrosses, up, ups, column, row, bits, _, _ = values
    away, shift = _ramp(b, near, nears).inverse(1.0 / FAR), _all(b, bits)
    u = (_ramp(b, across, acrosses) * away).whole() + _all(b, column)
    v = (_ramp(b, up, ups) * away).whole() + _all(b, row)
    within = _all(b, b.sub(b.shl(ir.Constant(INT, 1), bits), ir.Constant(INT, 1)))
    places = ((u >> 8) & within) + (((v >> 8) & within) << shift)
    return _Row(context, b, signature.args[0], texels).look_up(base, places), u, v


@intrinsic
def paint(
    _typing: Context, samples: Type, at: Type, base: Type, base_step: Type, mix: Type, mix_step: Type, white: Type,
    line: Type, x: Type,
) -> Lowered:  # fmt: skip
    """Write LANES pixels to ``line`` from ``x`` on: base + mix times their samples, at most ``white``."""

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        _, at, base, base_step, mix, mix_step, white, _, x = values
        source, target = (_Row(context, b, signature.args[i], values[i]) for i in (0, 7))
        value = _ramp(b, base, base_step) + _ramp(b, mix, mix_step) * Lanes(b, source.load(at))
        target.store(x, value.rounded().at_most(_all(b, white)).bytes())
        return context.get_dummy_value()

    return types.void(samples, at, base, base_step, mix, mix_step, white, line, x), write


@intrinsic
def paint_twice(
    _typing: Context, samples: Type, at: Type, base: Type, base_step: Type, mix: Type, mix_step: Type, white: Type,
    line: Type, x: Type,
) -> Lowered:  # fmt: skip
    """Write 2 LANES pixels from LANES samples and the next one: each second pixel lies between two samples."""

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        _, at, base, base_step, mix, mix_step, white, _, x = values
        source, target = (_Row(context, b, signature.args[i], values[i]) for i in (0, 7))
        here, there = Lanes(b, source.load(at)), Lanes(b, source.load(b.add(at, ir.Constant(LONG, 1))))
        bases, mixes, most = _ramp(b, base, base_step), _ramp(b, mix, mix_step), _all(b, white)
        even = (bases + mixes * here).rounded().at_most(most).bytes()
        odd = (bases + mixes * ((here + there) >> 1)).rounded().at_most(most).bytes()
        order = [pixel // 2 + LANES * (pixel % 2) for pixel in range(2 * LANES)]
        target.store(x, b.shuffle_vector(even, odd, ir.Constant(ir.VectorType(INT, 2 * LANES), order)))
        return context.get_dummy_value()

    return types.void(samples, at, base, base_step, mix, mix_step, white, line, x), write


@intrinsic
def tint(_typing: Context, samples: Type, at: Type, step: Type, base: Type, mix: Type, line: Type, x: Type) -> Lowered:
    """Write LANES values of colour to ``line`` from ``x`` on, from each sample (``step`` 1) or each second one (2)."""

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        _, at, step, base, mix, _, x = values
        source, target = (_Row(context, b, signature.args[i], values[i]) for i in (0, 5))
        many = source.load(at, 2 * LANES)
        first, second = (
            b.shuffle_vector(many, many, ir.Constant(INTS, [lane * every for lane in range(LANES)])) for every in (1, 2)
        )
        chosen = b.select(b.icmp_signed("==", step, ir.Constant(step.type, 1)), first, second)
        target.store(x, (_all(b, base) + _all(b, mix) * Lanes(b, chosen)).rounded().bytes())
        return context.get_dummy_value()

    return types.void(samples, at, step, base, mix, line, x), write
