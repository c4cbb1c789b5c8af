"""Sessions of browsers: a cookie stands for what a person showed at the log-in page, until they log out.

A session holds the proof and not the verdict: every request asks the admission anew, so that a password that was
changed or a right that was revoked counts for signed-in browsers as it does for everybody else.
"""

from __future__ import annotations

import hashlib
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass

from roboglot.model.admission import Proof

COOKIE = "roboglot"
COOKIE_MAX = 4096  # characters of a Cookie header that are read
SESSIONS_MAX = 1000
SESSIONS_OF_ONE_MAX = 20
LIFETIME = 12 * 3600.0  # s
TOKEN_BYTES = 32


@dataclass(frozen=True, slots=True)
class Session:
    """Session behind a cookie. ``name``: the person signed in. ``robot``: the one that a pupil was given."""

    proof: Proof
    name: str
    until: float
    robot: str = ""
    code: str = ""


class Sessions:
    """All of one console, in memory: only hashes of the cookies are kept."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._sessions: dict[str, Session] = {}

    def open(self, proof: Proof, name: str, robot: str = "", code: str = "") -> str:
        """Begin a session; returns the cookie's value."""
        now = self._now()
        self._sessions = {key: session for key, session in self._sessions.items() if session.until > now}
        own = [key for key, session in self._sessions.items() if session.name == name]
        for key in own[: len(own) - SESSIONS_OF_ONE_MAX + 1] if len(own) >= SESSIONS_OF_ONE_MAX else ():
            del self._sessions[key]
        if len(self._sessions) >= SESSIONS_MAX:
            del self._sessions[next(iter(self._sessions))]
        token = secrets.token_urlsafe(TOKEN_BYTES)
        self._sessions[_key(token)] = Session(proof, name, now + LIFETIME, robot, code)
        return token

    def find(self, token: str) -> Session | None:
        """The session of a cookie, while it lasts."""
        session = self._sessions.get(_key(token)) if token else None
        return session if session is not None and session.until > self._now() else None

    def end(self, token: str) -> None:
        """End one session."""
        self._sessions.pop(_key(token), None)

    def end_all_of(self, name: str) -> None:
        """End every session of one person."""
        self._sessions = {key: session for key, session in self._sessions.items() if session.name != name}


def cookie_name(port: int) -> str:
    """Cookies are shared by all ports of a host: each console has a name of its own."""
    return f"{COOKIE}-{port}"


def read_cookie(rows: list[tuple[bytes, bytes]], name: str) -> str:
    """The value of one cookie of a request; empty if there is none."""
    for header, value in rows:
        if header == b"cookie":
            for part in value[:COOKIE_MAX].decode("latin-1").split(";"):
                key, _, token = part.strip().partition("=")
                if key == name:
                    return token
    return ""


def set_cookie(name: str, token: str, *, secure: bool) -> tuple[bytes, bytes]:
    """The header that has a browser keep a session's cookie; an empty token has it forgotten."""
    age = int(LIFETIME) if token else 0
    safe = "; Secure" if secure else ""
    return b"set-cookie", f"{name}={token}; Path=/; Max-Age={age}; HttpOnly; SameSite=Strict{safe}".encode()


def _key(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()
