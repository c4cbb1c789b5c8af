"""Translates database errors to those of the program stores."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from roboglot.programs.errors import StoreError
from roboglot.storage.transactions import FAILURES


@contextmanager
def store_errors() -> Iterator[None]:
    """Raise StoreError if the database fails or the robot's disk is full."""
    try:
        yield
    except FAILURES as error:
        raise StoreError(str(error)) from error
