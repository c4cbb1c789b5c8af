"""Who asks: where access is configured, a browser or a script shows who it is; else this machine's programs come in."""

from __future__ import annotations

from roboglot.console.desk import CLIENT, Desk
from roboglot.console.http import Scope
from roboglot.model.admission import NO_PROOF, Proof, ProofKind
from roboglot.model.client_context import ask_for

CHALLENGE = (b"www-authenticate", b'Basic realm="roboglot", charset="UTF-8"')


async def enter(desk: Desk, scope: Scope) -> str:
    """From here on it is asked for who the client is; returns a name that it showed, empty if it needed none.

    Raises Unknown.
    """
    host, port = scope.get("client") or ("", 0)
    address, who = f"{host}:{port}", ""
    shown = next((value.decode("latin-1") for name, value in scope["headers"] if name == b"authorization"), "")
    proof = Proof(ProofKind.HTTP, shown) if shown else NO_PROOF
    admission = next((r.admission for r in desk.robots.values() if r.admission.asks), None)
    if admission is not None:
        known = admission.known(address, proof)
        who = known if known is not None else await admission.admit(address, proof)
    named = who if shown and admission is not None else ""
    ask_for(f"{CLIENT} {named or host}".strip(), address, who)
    return named
