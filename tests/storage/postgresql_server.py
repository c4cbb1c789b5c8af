"""A PostgreSQL server of the tests' own: made in a temporary folder, on a socket there, as a user that isn't root."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psycopg
import pytest

BINARIES = Path("/usr/lib/postgresql")


def binary_folder() -> Path | None:
    """Return the folder of initdb and postgres; the newest of several."""
    if found := shutil.which("initdb"):
        return Path(found).resolve().parent
    versions = sorted(BINARIES.glob("*/bin/initdb"), key=lambda path: float(path.parts[-3]))
    return versions[-1].parent if versions else None


class PostgreSQLServer:
    """``url`` is a database that trusts any client that reaches its socket, or the network of ``address``."""

    def __init__(self, folder: Path, binaries: Path, address: str = "") -> None:
        self._folder, self._binaries, self._address = folder, binaries, address
        # The server refuses to run as root: another user runs it and owns the folder.
        self._user = pwd.getpwuid(65534) if os.geteuid() == 0 else None
        self._server: subprocess.Popen[bytes] | None = None
        self.url = f"postgresql:///postgres?host={address or folder}&user=robots"

    def create(self) -> None:
        """The empty database."""
        if self._user:
            os.chown(self._folder, self._user.pw_uid, self._user.pw_gid)
        data = ("-D", str(self._folder / "data"))
        settings = ("-U", "robots", "--auth=trust", "--no-sync", "--locale=C.UTF-8", "--encoding=UTF8")
        subprocess.run(
            self._command("initdb", *data, *settings), check=True, capture_output=True, timeout=180, **self._as
        )
        if self._address:
            with (self._folder / "data/pg_hba.conf").open("a") as rules:
                rules.write("host all robots samenet trust\n")

    def start(self) -> None:
        """Returns when it answers."""
        where = (
            "-c",
            f"listen_addresses={self._address}",
            "-c",
            f"unix_socket_directories={self._folder}",
            "-c",
            "fsync=off",
        )
        command = self._command("postgres", "-D", str(self._folder / "data"), *where)
        self._server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **self._as)
        ready = self._command("pg_isready", "-h", str(self._folder), "-t", "1")
        for _ in range(200):
            if subprocess.run(ready, capture_output=True, timeout=180, check=False).returncode == 0:
                return
            if self._server.poll() is not None:
                break
            time.sleep(0.05)
        raise RuntimeError("PostgreSQL did not start")

    @contextmanager
    def hanging(self) -> Iterator[None]:
        """Context in which the server takes connections and never answers; those that are open go on."""
        assert self._server is not None
        self._server.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._server.send_signal(signal.SIGCONT)

    def stop(self) -> None:
        """Stop at once; every client loses the connection."""
        if self._server:
            self._server.send_signal(signal.SIGQUIT)  # does not wait for clients
            self._server.wait(20)
            self._server = None

    def empty(self) -> None:
        """Empty the database; start the server if a failed test has left it stopped."""
        if self._server is None:
            self.start()
        with psycopg.connect(self.url, autocommit=True, connect_timeout=5) as connection:
            connection.execute("DROP SCHEMA public CASCADE")
            connection.execute("CREATE SCHEMA public")
            connection.execute("GRANT USAGE ON SCHEMA public TO PUBLIC")  # as in a new database

    def _command(self, name: str, *arguments: str) -> list[str]:
        return [str(self._binaries / name), *arguments]

    @property
    def _as(self) -> dict[str, Any]:
        user = {"user": self._user.pw_uid, "group": self._user.pw_gid, "extra_groups": []} if self._user else {}
        return {"cwd": self._folder, "env": {"PATH": os.environ["PATH"], "LC_ALL": "C.UTF-8"}, **user}


@contextmanager
def postgresql_server(binaries: Path, address: str = "") -> Iterator[PostgreSQLServer]:
    """Made, started and stopped again, with its folder."""
    with tempfile.TemporaryDirectory(prefix="pg") as folder:  # socket paths are short
        server = PostgreSQLServer(Path(folder), binaries, address)
        server.create()
        try:
            server.start()
            yield server
        finally:
            server.stop()


needs_postgresql = pytest.mark.skipif(
    binary_folder() is None, reason="no PostgreSQL server on this machine (Debian: apt-get install postgresql)"
)
