"""Databases of both kinds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from roboglot.storage.opening import open_database
from roboglot.storage.transactions import Transactions
from tests.storage.postgresql_server import needs_postgresql


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=needs_postgresql)])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Transactions]:
    """Yield an empty database: a file, then a server."""
    url = request.getfixturevalue("db_server").url if request.param == "postgresql" else ""
    opened = open_database(tmp_path / "test.db", url)
    yield opened
    opened.close()
