"""Store of identities and their rights: written by ``roboglot access``, read by the running robots.

A separate SQLite file or, if robots are stored on a PostgreSQL server, tables there for all programs of a fleet.
Several programs use it at once, so every change is one transaction that increments the version.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from ipaddress import IPv6Address, ip_address
from pathlib import Path

from roboglot.access.rights import ALL_ROBOTS, parse_rights, write_rights
from roboglot.access.secrets import new_token, password_hash, token_hash
from roboglot.operations import Right
from roboglot.storage.opening import open_private
from roboglot.storage.transactions import Connection, Transactions
from roboglot.values import dataclass

FILE = "access.db"  # in the data folder
SCHEMA = "roboglot.storage.schema.access"
NAME_MAX = 64  # characters
IDENTITIES_MAX = 10_000


class IdentityKind(StrEnum):
    """Kind of an identity, which determines its means of authentication."""

    PERSON = "person"  # shows a password
    MACHINE = "machine"  # shows a token
    APP = "app"  # shows a client certificate; its common name is the identity
    GUEST = "guest"  # shows a temporary token issued by the program: a pupil who joined a class by its code
    ADDRESS = "address"  # recognized by address, for clients without credentials


@dataclass(frozen=True, slots=True)
class Grant:
    """Rights on one robot (ALL_ROBOTS: on each), until a time (Unix s; None: unlimited)."""

    robot: str
    rights: frozenset[Right]
    until: float | None = None


@dataclass(frozen=True, slots=True)
class Identity:
    """An identity. ``password`` and ``token`` are their stored forms, which grant no access."""

    name: str
    kind: IdentityKind
    password: str
    token: str | None
    grants: tuple[Grant, ...]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The whole list at one instant; ``version`` is larger after every change."""

    version: int
    identities: tuple[Identity, ...]


def open_store(folder: Path, url: str = "") -> AccessStore:
    """Open the list of a data folder, or of a PostgreSQL server. Raises OSError, ValueError, sqlite3.Error."""
    return AccessStore(open_private(folder / FILE, SCHEMA, url))


class AccessStore:
    """The list in a database. Methods block, from any thread. Raises DatabaseError, ValueError, LookupError."""

    def __init__(self, database: Transactions) -> None:
        self._database = database

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    @property
    def version(self) -> int:
        """Version of the list, which every change increments."""
        return self._database.run_now(_version)

    def snapshot(self) -> Snapshot:
        """Return the whole list, by name."""
        return self._database.run_now(lambda connection: Snapshot(_version(connection), tuple(_all(connection))))

    def identities(self) -> list[Identity]:
        """Return all identities, by name."""
        return self._database.run_now(_all)

    def add_person(self, name: str, password: str, grants: Iterable[Grant]) -> None:
        """Add a person with a password and these rights; replaces any before."""
        self.put(Identity(name, IdentityKind.PERSON, password_hash(password), None, tuple(grants)))

    def add_machine(self, name: str, grants: Iterable[Grant]) -> str:
        """Add a machine; return its token, which is not stored."""
        token = new_token()
        self.put(Identity(name, IdentityKind.MACHINE, "", token_hash(token), tuple(grants)))
        return token

    def add_guest(self, name: str, grants: Iterable[Grant], now: float) -> str:
        """Add a guest and remove those expired at ``now`` (Unix s); return the guest's token. Raises ValueError."""
        token = new_token()
        guest = _checked(Identity(name, IdentityKind.GUEST, "", token_hash(token), tuple(grants)))

        def work(connection: Connection) -> None:
            for identity in _all(connection):
                over = all(grant.until is not None and grant.until < now for grant in identity.grants)
                if identity.kind is IdentityKind.GUEST and over:
                    connection.execute("DELETE FROM identity WHERE name=?", (identity.name,))
                elif identity.name == name and identity.kind is not IdentityKind.GUEST:
                    raise ValueError(f"there is a {identity.kind} named {name}")
            _put(connection, guest)

        self._database.run_now(work)
        return token

    def add_app(self, name: str, grants: Iterable[Grant]) -> None:
        """Add a CyberDog app, authenticated by the certificate with this common name."""
        self.put(Identity(name, IdentityKind.APP, "", None, tuple(grants)))

    def allow(self, address: str, grants: Iterable[Grant]) -> str:
        """Allow all clients from an address; return the address as stored."""
        given = ip_address(address)
        mapped = given.ipv4_mapped if isinstance(given, IPv6Address) else None
        name = str(mapped or given)  # as ``host_of`` has it
        self.put(Identity(name, IdentityKind.ADDRESS, "", None, tuple(grants)))
        return name

    def put(self, identity: Identity) -> None:
        """Add an identity, replacing the one of this name. Raises ValueError."""
        _checked(identity)
        self._database.run_now(lambda connection: _put(connection, identity))

    def rotate(self, name: str, password: str = "") -> str:
        """Replace the token (returns the new one) or the password; the old one is void. Raises LookupError."""
        kind = self._database.run_now(lambda connection: _kind(connection, name))
        if kind is IdentityKind.PERSON:
            self._set("password", password_hash(password), name)
            return ""
        if kind is not IdentityKind.MACHINE:
            raise ValueError(f"{name} is identified by its {kind}: there is nothing to rotate")
        token = new_token()
        self._set("token", token_hash(token), name)
        return token

    def _set(self, column: str, value: str, name: str) -> None:
        def work(connection: Connection) -> None:
            _kind(connection, name)
            connection.execute(f"UPDATE identity SET {column}=? WHERE name=?", (value, name))

        self._database.run_now(work)

    def revoke(self, name: str) -> None:
        """Remove an identity. Raises LookupError."""

        def work(connection: Connection) -> None:
            _kind(connection, name)
            connection.execute("DELETE FROM identity WHERE name=?", (name,))

        self._database.run_now(work)


def _checked(identity: Identity) -> Identity:
    """Return the identity if its name is valid. Raises ValueError."""
    name, forbidden = identity.name, " " if identity.kind is IdentityKind.ADDRESS else " :"
    if not 0 < len(name) <= NAME_MAX or not name.isprintable() or set(name) & set(forbidden):
        raise ValueError(f"a name has 1 to {NAME_MAX} characters, no blanks and no colon")
    return identity


def _version(connection: Connection) -> int:
    return int(connection.execute("SELECT number FROM access_version").fetchone()[0])


def _all(connection: Connection) -> list[Identity]:
    grants: dict[str, list[Grant]] = {}
    for name, robot, rights, until in connection.execute(
        "SELECT identity, robot, rights, until FROM allowed ORDER BY robot"
    ):
        grants.setdefault(name, []).append(Grant(robot, parse_rights(rights), until))
    rows = connection.execute("SELECT name, kind, password, token FROM identity ORDER BY name")
    return [Identity(row[0], IdentityKind(row[1]), row[2], row[3], tuple(grants.get(row[0], ()))) for row in rows]


def _put(connection: Connection, identity: Identity) -> None:
    if connection.execute("SELECT count(*) FROM identity").fetchone()[0] >= IDENTITIES_MAX:
        raise ValueError(f"at most {IDENTITIES_MAX} names")
    name = identity.name
    rows = [(name, grant.robot or ALL_ROBOTS, write_rights(grant.rights), grant.until) for grant in identity.grants]
    connection.execute("DELETE FROM identity WHERE name=?", (name,))
    values = (name, str(identity.kind), identity.password, identity.token)
    connection.execute("INSERT INTO identity (name, kind, password, token) VALUES (?, ?, ?, ?)", values)
    connection.executemany("INSERT INTO allowed (identity, robot, rights, until) VALUES (?, ?, ?, ?)", rows)


def _kind(connection: Connection, name: str) -> IdentityKind:
    row = connection.execute("SELECT kind FROM identity WHERE name=?", (name,)).fetchone()
    if row is None:
        raise LookupError(f"there is no {name!r}; `roboglot access list` shows all names")
    return IdentityKind(row[0])
