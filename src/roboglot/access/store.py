"""The list of who may do what, in a SQLite file of its own: written by ``roboglot access``, read by the running robots.

Two programs use it at once, so every change is one transaction, and ``version`` tells when another program made one.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from ipaddress import ip_address
from pathlib import Path

from roboglot.access.rights import ALL_ROBOTS, parse_rights, write_rights
from roboglot.access.secrets import new_token, password_hash, token_hash
from roboglot.operations import Right

FILE = "access.db"  # in the data folder
NAME_MAX = 64  # characters
IDENTITIES_MAX = 10_000
_SCHEMA = """
CREATE TABLE IF NOT EXISTS identity (
    name TEXT PRIMARY KEY, kind TEXT NOT NULL, password TEXT NOT NULL DEFAULT '', token TEXT UNIQUE
) STRICT;
CREATE TABLE IF NOT EXISTS allowed (
    identity TEXT NOT NULL REFERENCES identity (name) ON DELETE CASCADE,
    robot TEXT NOT NULL, rights TEXT NOT NULL, until REAL, PRIMARY KEY (identity, robot)
) STRICT;
"""


class Kind(StrEnum):
    """What an identity is, and so how it shows itself."""

    PERSON = "person"  # by a password
    MACHINE = "machine"  # by a token
    APP = "app"  # by a client certificate, whose common name is the identity's
    GUEST = "guest"  # by a token for a time, made by the program itself: a pupil who joined a class by its code
    ADDRESS = "address"  # by where it comes from: for clients that can show nothing


@dataclass(frozen=True, slots=True)
class Grant:
    """Rights on one robot (ALL_ROBOTS: on each), until an instant (Unix time in s; None: for good)."""

    robot: str
    rights: frozenset[Right]
    until: float | None = None


@dataclass(frozen=True, slots=True)
class Identity:
    """One who may come in. ``password`` and ``token`` are what is kept of them, not what lets in."""

    name: str
    kind: Kind
    password: str
    token: str | None
    grants: tuple[Grant, ...]


class AccessStore:
    """Open with ``AccessStore(path)``, close with ``close``. One thread at a time. Raises sqlite3.Error, ValueError."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        path.touch(mode=0o600)
        self._connection = sqlite3.connect(path, isolation_level=None, timeout=5.0, check_same_thread=False)
        self._connection.executescript("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON;")
        self._connection.executescript(_SCHEMA)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    @property
    def version(self) -> int:
        """Another number after another program has changed the file."""
        return int(self._connection.execute("PRAGMA data_version").fetchone()[0])

    def add_person(self, name: str, password: str, grants: Iterable[Grant]) -> None:
        """Let a person in by a password, with these rights and no others."""
        self._put(name, Kind.PERSON, grants, password=password_hash(password))

    def add_machine(self, name: str, grants: Iterable[Grant]) -> str:
        """Let a machine in; its token, which is known this once."""
        token = new_token()
        self._put(name, Kind.MACHINE, grants, token=token_hash(token))
        return token

    def add_guest(self, name: str, grants: Iterable[Grant], now: float) -> str:
        """Let a guest in, and forget those whose time is over at ``now``; the guest's token. Raises ValueError."""
        for identity in self.identities():
            over = all(grant.until is not None and grant.until < now for grant in identity.grants)
            if identity.kind is Kind.GUEST and over:
                self.revoke(identity.name)
            elif identity.name == name and identity.kind is not Kind.GUEST:
                raise ValueError(f"there is a {identity.kind} named {name}")
        token = new_token()
        self._put(name, Kind.GUEST, grants, token=token_hash(token))
        return token

    def add_app(self, name: str, grants: Iterable[Grant]) -> None:
        """Let a CyberDog app in by the certificate with this common name."""
        self._put(name, Kind.APP, grants)

    def allow(self, address: str, grants: Iterable[Grant]) -> str:
        """Let in whatever comes from an address; the address as it is kept."""
        name = str(ip_address(address))
        self._put(name, Kind.ADDRESS, grants)
        return name

    def rotate(self, name: str, password: str = "") -> str:
        """Another token (returned) or this password; the old one is no longer valid. Raises LookupError."""
        kind = self._kind(name)
        if kind is Kind.PERSON:
            self._set("UPDATE identity SET password=? WHERE name=?", (password_hash(password), name))
            return ""
        if kind is not Kind.MACHINE:
            raise ValueError(f"{name} is let in by its {kind}: there is nothing to rotate")
        token = new_token()
        self._set("UPDATE identity SET token=? WHERE name=?", (token_hash(token), name))
        return token

    def revoke(self, name: str) -> None:
        """Let it in no more. Raises LookupError."""
        self._kind(name)
        self._set("DELETE FROM identity WHERE name=?", (name,))

    def identities(self) -> list[Identity]:
        """All, by name."""
        grants: dict[str, list[Grant]] = {}
        for name, robot, rights, until in self._connection.execute(
            "SELECT identity, robot, rights, until FROM allowed ORDER BY robot"
        ):
            grants.setdefault(name, []).append(Grant(robot, parse_rights(rights), until))
        rows = self._connection.execute("SELECT name, kind, password, token FROM identity ORDER BY name")
        return [Identity(row[0], Kind(row[1]), row[2], row[3], tuple(grants.get(row[0], ()))) for row in rows]

    def _put(
        self, name: str, kind: Kind, grants: Iterable[Grant], *, password: str = "", token: str | None = None
    ) -> None:
        forbidden = " " if kind is Kind.ADDRESS else " :"
        if not 0 < len(name) <= NAME_MAX or not name.isprintable() or set(name) & set(forbidden):
            raise ValueError(f"a name has 1 to {NAME_MAX} characters, no blanks and no colon")
        count = self._connection.execute("SELECT count(*) FROM identity").fetchone()[0]
        if count >= IDENTITIES_MAX:
            raise ValueError(f"at most {IDENTITIES_MAX} names")
        rows = [(name, grant.robot or ALL_ROBOTS, write_rights(grant.rights), grant.until) for grant in grants]
        with self._transaction() as connection:
            connection.execute("DELETE FROM identity WHERE name=?", (name,))
            connection.execute("INSERT INTO identity VALUES (?, ?, ?, ?)", (name, kind, password, token))
            connection.executemany("INSERT INTO allowed VALUES (?, ?, ?, ?)", rows)

    def _set(self, query: str, values: tuple[str, ...]) -> None:
        self._connection.execute(query, values)

    def _transaction(self) -> sqlite3.Connection:
        self._connection.execute("BEGIN IMMEDIATE")
        return self._connection

    def _kind(self, name: str) -> Kind:
        row = self._connection.execute("SELECT kind FROM identity WHERE name=?", (name,)).fetchone()
        if row is None:
            raise LookupError(f"there is no {name!r}; `roboglot access list` shows who there is")
        return Kind(row[0])
