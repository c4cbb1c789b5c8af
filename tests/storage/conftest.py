"""Databases of both kinds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from roboglot.storage.opening import open_database
from roboglot.storage.transactions import Transactions
from tests.storage.postgresql_server import PostgreSQLServer, binary_folder, needs_postgresql, postgresql_server


@pytest.fixture(scope="module")
def server() -> Iterator[PostgreSQLServer]:
    """A server for one module's tests."""
    binaries = binary_folder()
    assert binaries
    with postgresql_server(binaries) as running:
        yield running


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=needs_postgresql)])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Transactions]:
    """An empty one, on a file and on a server."""
    url = ""
    if request.param == "postgresql":
        running: PostgreSQLServer = request.getfixturevalue("server")
        running.empty()
        url = running.url
    opened = open_database(tmp_path / "test.db", url)
    yield opened
    opened.close()
