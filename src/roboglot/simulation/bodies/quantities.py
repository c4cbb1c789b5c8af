"""Bounded numbers of body files. SI units."""

from typing import Annotated

from msgspec import Meta

Positive = Annotated[float, Meta(gt=0, le=10_000)]
NotNegative = Annotated[float, Meta(ge=0, le=10_000)]
Fraction = Annotated[float, Meta(ge=0, le=1)]
Offset = Annotated[float, Meta(ge=-5, le=5)]
Pair = tuple[Offset, Offset]
Angle = Annotated[float, Meta(ge=-3.2, le=3.2)]
Count = Annotated[int, Meta(ge=1, le=32)]
