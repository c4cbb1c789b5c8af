"""Sessions of browsers on the disk, so that people stay signed in over restarts of the program.

The file grants no access: it holds a hash of each cookie, and the owner's proof, encrypted with the cookie.
"""

from __future__ import annotations

import hashlib
import logging
import os
from pathlib import Path

from roboglot.model.admission import Proof, ProofKind
from roboglot.model.errors import RobotError
from roboglot.storage.opening import open_private
from roboglot.storage.transactions import Connection
from roboglot.values import dataclass

log = logging.getLogger(__name__)
SCHEMA = "roboglot.storage.schema.sessions"
NONCE_BYTES = 12


@dataclass(frozen=True, slots=True)
class KeptSession:
    """Row of the file. ``until``: Unix time (s)."""

    key: str
    name: str
    sealed: bytes
    until: float
    robot: str
    code: str


class SessionFile:
    """The file of one console. Raises OSError, ValueError, sqlite3.Error, DatabaseError if it cannot be opened."""

    def __init__(self, path: Path) -> None:
        self._database = open_private(path, SCHEMA)

    def load(self, now: float) -> list[KeptSession]:
        """Return sessions valid at ``now`` (Unix s), the oldest first, and delete the others. Raises DatabaseError."""

        def work(connection: Connection) -> list[KeptSession]:
            connection.execute("DELETE FROM session WHERE until<=?", (now,))
            rows = connection.execute("SELECT key, name, proof, until, robot, code FROM session ORDER BY until")
            return [KeptSession(*row) for row in rows]

        return self._database.run_now(work)

    async def keep(self, session: KeptSession) -> None:
        """Write a session; after a failure it lasts only until the program ends."""
        values = (session.key, session.name, session.sealed, session.until, session.robot, session.code)
        insert = "INSERT OR REPLACE INTO session (key, name, proof, until, robot, code) VALUES (?, ?, ?, ?, ?, ?)"
        try:
            await self._database.run(lambda connection: connection.execute(insert, values).rowcount)
        except RobotError as error:
            log.error("cannot store the session of %s for a restart: %s", session.name, error)

    async def drop(self, keys: list[str]) -> None:
        """Delete sessions."""
        rows = [(key,) for key in keys]

        def work(connection: Connection) -> None:
            connection.executemany("DELETE FROM session WHERE key=?", rows)

        try:
            await self._database.run(work)
        except RobotError as error:
            log.error("cannot delete %d sessions, so a restart restores them: %s", len(keys), error)

    def close(self) -> None:
        """Finish writing."""
        self._database.close()


def seal(proof: Proof, token: str) -> bytes:
    """Return a proof, encrypted so that only the cookie decrypts it."""
    from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305

    nonce = os.urandom(NONCE_BYTES)
    text = f"{proof.kind}\n{proof.value}".encode("utf-8", "surrogatepass")
    return nonce + ChaCha20Poly1305(_sealing(token)).encrypt(nonce, text, None)


def unseal(sealed: bytes, token: str) -> Proof | None:
    """Return the decrypted proof; None for another cookie or a changed row."""
    from cryptography.exceptions import InvalidTag
    from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305

    nonce, text = sealed[:NONCE_BYTES], sealed[NONCE_BYTES:]
    try:
        opened = ChaCha20Poly1305(_sealing(token)).decrypt(nonce, text, None)
        kind, _, value = opened.decode("utf-8", "surrogatepass").partition("\n")
        return Proof(ProofKind(kind), value)
    except (InvalidTag, ValueError):
        return None


def _sealing(token: str) -> bytes:
    """Return the key; it does not follow from the cookie's hash in the file."""
    return hashlib.sha256(b"seal" + token.encode("utf-8", "surrogatepass")).digest()
