"""Loads every kernel, compiling ahead what is not cached. Knows none of them but by name."""

from __future__ import annotations

import importlib
from collections.abc import Iterator

from roboglot.kernels import MODULES


def load() -> Iterator[str]:
    """Import every kernel; yields the name of each that is ready."""
    for name in MODULES:
        importlib.import_module(f"roboglot.kernels.{name}")
        yield name
