"""Check of options that are numbers, beside the bounds of their types, which NaN passes."""

from __future__ import annotations

import math

import typer


def finite(value: float) -> float:
    """Return a number that is one. Raises BadParameter."""
    if not math.isfinite(value):
        raise typer.BadParameter(f"must be a finite number, not {value}")
    return value
