"""Failures of the database as the program stores report them."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

from roboglot.programs.errors import StoreError
from roboglot.storage.database import DiskFull


@contextmanager
def store_errors() -> Iterator[None]:
    """Raise StoreError where the database fails or the robot's disk is full."""
    try:
        yield
    except (sqlite3.Error, DiskFull) as error:
        raise StoreError(str(error)) from error
