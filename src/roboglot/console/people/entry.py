"""Admission of clients: browsers and scripts authenticate if access is configured; else local programs are admitted."""

from __future__ import annotations

from roboglot.console.desk import CLIENT, Desk
from roboglot.console.http import Scope, session_lasts
from roboglot.console.people.sessions import Sessions, cookie_name, read_cookie
from roboglot.model.admission import NO_PROOF, Admission, LockedOut, Proof, ProofKind, Unknown
from roboglot.model.client_context import set_client
from roboglot.protocols.forwarding import caller

CHALLENGE = (b"www-authenticate", b'Bearer realm="roboglot"')  # not Basic: browsers would open their own prompt


def admission_of(desk: Desk) -> Admission | None:
    """Return the admission that authenticates clients; None: all clients are admitted."""
    return next((robot.admission for robot in desk.robots.values() if robot.admission.enforced), None)


def address_of(scope: Scope) -> str:
    """Return the client's "host:port", as ``caller`` has it."""
    host, port = scope.get("client") or ("", 0)
    return caller(f"{host}:{port}", scope["headers"])


def cookie_of(scope: Scope) -> str:
    """Return this console's cookie; empty if there is none."""
    return read_cookie(scope["headers"], cookie_name((scope.get("server") or ("", 0))[1] or 0))


async def enter(desk: Desk, sessions: Sessions, scope: Scope) -> str:
    """Authenticate the client for the current context; return its proven name, empty if none was needed.

    Raises Unknown.
    """
    address, cookie, who = address_of(scope), cookie_of(scope), ""
    shown = next((value.decode("latin-1") for name, value in scope["headers"] if name == b"authorization"), "")
    session = None if shown else sessions.find(cookie)
    if session is not None:
        session_lasts.set(lambda: sessions.find(cookie) is not None)
    if (admission := admission_of(desk)) is not None:
        kept = session.proof if session is not None else NO_PROOF
        proof = Proof(ProofKind.HTTP, shown) if shown else _vouched(kept)
        try:
            who = await _identity(admission, address, proof)
        except LockedOut:
            raise
        except Unknown:
            if session is not None:  # a session replaces earlier proofs
                await sessions.end(cookie)
            raise
    named = session.name if session is not None else who if shown else ""
    set_client(f"{CLIENT} {named or address.rpartition(':')[0]}".strip(), address, who)
    return named


def _vouched(kept: Proof) -> Proof:
    """Return a session's proof, of a kind that does not count as a guess: a valid cookie came with it."""
    return Proof(ProofKind.SESSION, kept.value) if kept.kind is ProofKind.HTTP else kept


async def _identity(admission: Admission, address: str, proof: Proof) -> str:
    """Return the name that a proof proves. Raises Unknown."""
    known = admission.cached_identity(address, proof)
    return known if known is not None else await admission.admit(address, proof)
