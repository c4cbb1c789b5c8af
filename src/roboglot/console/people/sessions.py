"""Sessions of browsers: a cookie stands for a person's proof at the log-in page, until they log out.

With a file, a session outlives the program. It holds the proof, not the verdict: every request is checked again, so
changed passwords and revoked rights apply to signed-in browsers, too.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Callable
from dataclasses import replace

from roboglot.access.session_file import KeptSession, SessionFile, seal, unseal
from roboglot.hosting.steady_time import SteadyTime
from roboglot.model.admission import NO_PROOF, Proof
from roboglot.values import dataclass

COOKIE = "roboglot"
COOKIE_MAX = 4096  # characters of a Cookie header that are read
SESSIONS_MAX = 1000
SESSIONS_OF_ONE_MAX = 20
LIFETIME = 12 * 3600.0  # s
TOKEN_BYTES = 32


@dataclass(frozen=True, slots=True)
class Session:
    """Session behind a cookie. ``name``: the signed-in person. ``robot``: a pupil's robot."""

    proof: Proof
    name: str
    until: float
    robot: str = ""
    code: str = ""


class Sessions:
    """All sessions of one console, by hashes of their cookies. With a ``file`` they outlive the program.

    Raises DatabaseError if it cannot be read.
    """

    def __init__(self, file: SessionFile | None = None, now: Callable[[], float] | None = None) -> None:
        self._file, self._now = file, now or SteadyTime()
        left = file.load(self._now()) if file is not None else []
        latest = self._now() + LIFETIME  # also where the clock was set back, or a board without one starts in 1970
        self._sessions = {
            kept.key: Session(NO_PROOF, kept.name, min(kept.until, latest), kept.robot, kept.code) for kept in left
        }
        self._sealed = {kept.key: kept.sealed for kept in left}  # proofs of sessions not used since the start

    def all(self) -> list[Session]:
        """Return all valid sessions; the proof of one that was not used since the start is unknown."""
        return [session for session in self._sessions.values() if session.until > self._now()]

    async def open(self, proof: Proof, name: str, robot: str = "", code: str = "") -> str:
        """Begin a session; return the cookie's value."""
        now = self._now()
        ended = [key for key, session in self._sessions.items() if session.until <= now]
        own = [key for key, session in self._sessions.items() if session.name == name and key not in ended]
        ended += own[: len(own) - SESSIONS_OF_ONE_MAX + 1] if len(own) >= SESSIONS_OF_ONE_MAX else []
        if len(self._sessions) - len(ended) >= SESSIONS_MAX:
            ended.append(next(key for key in self._sessions if key not in ended))
        token = secrets.token_urlsafe(TOKEN_BYTES)
        key, until = _key(token), now + LIFETIME
        self._sessions[key] = Session(proof, name, until, robot, code)
        await self._drop(ended)
        if self._file is not None and key in self._sessions:  # not put out meanwhile
            await self._file.keep(KeptSession(key, name, seal(proof, token), until, robot, code))
        return token

    def find(self, token: str) -> Session | None:
        """Return the session of a cookie; None if there is no valid one."""
        key = _key(token) if token else ""
        session = self._sessions.get(key)
        if session is None or session.until <= self._now():
            return None
        if (sealed := self._sealed.pop(key, None)) is not None:
            proof = unseal(sealed, token)
            if proof is None:
                del self._sessions[key]
                return None
            session = self._sessions[key] = replace(session, proof=proof)
        return session

    async def end(self, token: str) -> None:
        """End one session."""
        if token and _key(token) in self._sessions:
            await self._drop([_key(token)])

    async def end_all_of(self, name: str) -> None:
        """End every session of one person."""
        await self._drop([key for key, session in self._sessions.items() if session.name == name])

    async def _drop(self, keys: list[str]) -> None:
        for key in keys:
            self._sessions.pop(key, None)
            self._sealed.pop(key, None)
        if keys and self._file is not None:
            await self._file.drop(keys)

    def close(self) -> None:
        """Finish writing."""
        if self._file is not None:
            self._file.close()


def cookie_name(port: int) -> str:
    """Return the cookie's name, one per console, as all ports of a host share cookies."""
    return f"{COOKIE}-{port}"


def read_cookie(rows: list[tuple[bytes, bytes]], name: str) -> str:
    """Return the value of a request's cookie; empty if there is none."""
    for header, value in rows:
        if header == b"cookie":
            for part in value[:COOKIE_MAX].decode("latin-1").split(";"):
                key, _, token = part.strip().partition("=")
                if key == name:
                    return token
    return ""


def set_cookie(
    name: str, token: str, *, secure: bool, path: str = "/", lifetime: float = LIFETIME
) -> tuple[bytes, bytes]:
    """Return the header that sets a session's cookie; an empty token deletes it."""
    age = int(lifetime) if token else 0
    safe = "; Secure" if secure else ""
    return b"set-cookie", f"{name}={token}; Path={path}; Max-Age={age}; HttpOnly; SameSite=Strict{safe}".encode()


def _key(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()
