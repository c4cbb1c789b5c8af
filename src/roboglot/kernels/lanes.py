"""Sixteen pixels at once: what kernels do with whole vectors, written as LLVM's own instructions.

Numba widens whole numbers to 64 bits, and LLVM does not turn look-ups into vectors: loops over pixels in Python took
four times as long. Each function here is one step of ``raster_shading`` for LANES neighbours; LLVM makes of it whatever
the processor has. Numbers are 32 bits and wrap; fractions of brightness and colour have 16 bits behind the point.
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
from numba.np.arrayobj import make_array

LANES = 16
BYTE, INT, LONG, BIT = ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.IntType(1)
INTS, LONGS, BITS, POINTERS = (ir.VectorType(kind, LANES) for kind in (INT, LONG, BIT, ir.PointerType(INT)))
Values = tuple[ir.Value, ...]
Lowered = tuple[Signature, Callable[[Context, ir.IRBuilder, Signature, Values], ir.Value]]


class Lanes:
    """A vector of numbers while a kernel is compiled: arithmetic on it writes instructions."""

    __slots__ = ("_builder", "value")

    def __init__(self, builder: ir.IRBuilder, value: ir.Value) -> None:
        self._builder, self.value = builder, value

    def __add__(self, other: Lanes) -> Lanes:
        return Lanes(self._builder, self._builder.add(self.value, other.value))

    def __sub__(self, other: Lanes) -> Lanes:
        return Lanes(self._builder, self._builder.sub(self.value, other.value))

    def __mul__(self, other: Lanes) -> Lanes:
        return Lanes(self._builder, self._builder.mul(self.value, other.value))

    def __and__(self, other: Lanes | int) -> Lanes:
        return Lanes(self._builder, self._builder.and_(self.value, self._like(other)))

    def __rshift__(self, bits: int) -> Lanes:
        """Shift in zeros."""
        return Lanes(self._builder, self._builder.lshr(self.value, self._like(bits)))

    def complement(self, whole: int) -> Lanes:
        """Return ``whole`` less these numbers."""
        return Lanes(self._builder, self._builder.sub(self._like(whole), self.value))

    def rounded(self) -> Lanes:
        """Return the numbers, which may be negative, without their 16 bits behind the point."""
        return Lanes(self._builder, self._builder.ashr(self.value, self._like(16)))

    def at_most(self, limit: Lanes) -> Lanes:
        """Return the lesser numbers of both."""
        below = self._builder.icmp_signed("<", self.value, limit.value)
        return Lanes(self._builder, self._builder.select(below, self.value, limit.value))

    def bytes(self) -> ir.Value:
        """Return the lowest 8 bits of each."""
        return self._builder.trunc(self.value, ir.VectorType(BYTE, LANES))

    def _like(self, other: Lanes | int) -> ir.Value:
        return other.value if isinstance(other, Lanes) else ir.Constant(self.value.type, [other] * LANES)


def _all(builder: ir.IRBuilder, number: ir.Value) -> Lanes:
    """Return ``number`` in every lane."""
    kind = ir.VectorType(number.type, LANES)
    blank = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(blank, number, ir.Constant(INT, 0))
    return Lanes(builder, builder.shuffle_vector(first, blank, ir.Constant(INTS, [0] * LANES)))


def _ramp(builder: ir.IRBuilder, first: ir.Value, step: ir.Value) -> Lanes:
    """Return ``first``, and in each further lane ``step`` more."""
    numbers = Lanes(builder, ir.Constant(INTS, list(range(LANES))))
    return _all(builder, first) + _all(builder, step) * numbers


class _Row:
    """A contiguous array while a kernel is compiled; its elements count from its first, whatever its shape."""

    def __init__(self, context: Context, builder: ir.IRBuilder, kind: Type, array: ir.Value) -> None:
        self._builder, self._start = builder, make_array(kind)(context, builder, array).data

    def load(self, at: ir.Value, count: int = LANES) -> ir.Value:
        """Return ``count`` numbers of 32 bits from element ``at`` on."""
        place = self._builder.bitcast(self._builder.gep(self._start, [at]), ir.PointerType(ir.VectorType(INT, count)))
        return self._builder.load(place, align=4)

    def store(self, at: ir.Value, vector: ir.Value) -> None:
        """Write a vector from element ``at`` on."""
        place = self._builder.bitcast(self._builder.gep(self._start, [at]), ir.PointerType(vector.type))
        self._builder.store(vector, place, align=vector.type.element.width // 8)

    def look_up(self, base: ir.Value, places: Lanes) -> Lanes:
        """Return the numbers of 32 bits at ``base`` + ``places``, which are not negative."""
        builder = self._builder
        first = builder.ptrtoint(builder.gep(self._start, [base]), LONG)
        off = builder.shl(builder.zext(places.value, LONGS), ir.Constant(LONGS, [2] * LANES))
        pointers = builder.inttoptr(builder.add(_all(builder, first).value, off), POINTERS)
        kind = ir.FunctionType(INTS, [POINTERS, INT, BITS, INTS])
        gather = cgutils.get_or_insert_function(builder.module, kind, f"llvm.masked.gather.v{LANES}i32.v{LANES}p0")
        blank = ir.Constant(INTS, ir.Undefined)
        found = builder.call(gather, [pointers, ir.Constant(INT, 4), ir.Constant(BITS, [1] * LANES), blank])
        return Lanes(builder, found)


@intrinsic
def sample(
    _typing: Context, texels: Type, base: Type, column: Type, columns: Type, row: Type, rows: Type, within: Type,
    above: Type, fraction: Type, samples: Type, at: Type,
) -> Lowered:  # fmt: skip
    """Write LANES samples of a texture, 0 to 255, to ``samples`` from ``at`` on.

    ``texels``, from ``base`` on: each with its right, upper and upper right neighbour in its four bytes. ``column``,
    and ``row`` times the texture's width, have 16 bits behind the point, ``columns`` and ``rows`` are their steps from
    lane to lane; ``within`` and ``above`` are the bits that name a column and a row. ``fraction``: 255 mixes
    neighbours, 0 takes the texel alone.
    """

    def write(context: Context, b: ir.IRBuilder, signature: Signature, values: Values) -> ir.Value:
        _, base, column, columns, row, rows, within, above, fraction, _, at = values
        source, target = (_Row(context, b, signature.args[i], values[i]) for i in (0, 9))
        u, v = _ramp(b, column, columns), _ramp(b, row, rows)
        four = source.look_up(base, ((u >> 16) & _all(b, within)) + ((v >> 16) & _all(b, above)))
        right, up = (u >> 8) & _all(b, fraction), (v >> 16) & _all(b, fraction)
        two = (four & 0xFF00FF) * right.complement(256) + ((four >> 8) & 0xFF00FF) * right
        target.store(at, (((two & 0xFFFF) * up.complement(256) + (two >> 16) * up) >> 16).value)
        return context.get_dummy_value()

    arguments = (texels, base, column, columns, row, rows, within, above, fraction, samples, at)
    return types.void(*arguments), write


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
