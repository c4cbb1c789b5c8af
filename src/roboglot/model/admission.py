"""Access control: every door asks it when a client connects and before each operation.

Without access control, ``enforced`` is false, and doors check nothing.
"""

from __future__ import annotations

from asyncio import Protocol, Server
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import NamedTuple

from roboglot.model.errors import Forbidden
from roboglot.operations import Right

__all__ = ["NO_PROOF", "Admission", "Forbidden", "LockedOut", "Proof", "ProofKind", "Right", "Unknown"]


class ProofKind(StrEnum):
    """Means by which a client authenticates."""

    NONE = "none"
    HTTP = "http"  # the value of an Authorization header: "Bearer TOKEN" or "Basic …"
    SESSION = "session"  # such a value, from the log-in of a browser whose cookie is valid
    CERTIFICATE = "certificate"  # the common name of a certificate that TLS has verified


class Proof(NamedTuple):
    """Credentials of a client; ``value`` may be a secret and is never logged.

    ``device``: mark of a browser in which someone has logged in before (``Admission.device``).
    """

    kind: ProofKind
    value: str
    device: str = ""

    def __repr__(self) -> str:
        return f"Proof({self.kind})"


NO_PROOF = Proof(ProofKind.NONE, "")
THROUGH = " through "  # "10.0.0.7 through 127.0.0.1:40312": another machine, for which a proxy on this one asks


class Unknown(Forbidden):
    """The client is unknown or anonymous; it may try again with a proof."""


class LockedOut(Unknown):
    """Too many wrong proofs from an address, or for a name: further ones are refused for a while."""


class Admission:
    """Admission to one robot. This base class admits every client, with all rights."""

    enforced = False
    outsiders = False  # where not ``enforced``: other machines are admitted, too, for which a proxy on this one asks
    connections_max = 0  # per address, where ``enforced``

    def cached_identity(self, address: str, proof: Proof = NO_PROOF) -> str | None:
        """Return the identity of the client at ``address`` ("10.0.0.7:40312") if it is cached; None: call ``admit``."""
        return ""

    async def admit(self, address: str, proof: Proof = NO_PROOF) -> str:
        """Return the client's identity: the name of a person or machine, or an address. Raises Unknown."""
        return ""

    def device(self, name: str, shown: str) -> str:
        """Return the mark for a browser in which ``name`` has just logged in: ``shown`` if it is one, else a new one.

        Wrong passwords with it count for this browser alone. Empty for those without a password.
        """
        return ""

    def check(self, door: str, operation: str, right: Right | None) -> None:
        """Raise Forbidden unless the current client (``client_context.identity``) has ``right``; None is ADMIN."""

    @contextmanager
    def noting(self, door: str, operation: str) -> Iterator[None]:
        """Audit the outcome of a change that no tap shows: done, or refused and why."""
        yield

    def may(self, right: Right) -> bool:
        """True if the current client has ``right``."""
        return True

    async def invite(self, name: str, rights: frozenset[Right], seconds: float) -> Proof | None:
        """Admit a guest for ``seconds``; return the guest's secret, or None where there is no access control."""
        return None

    async def shut_out(self, name: str) -> None:
        """Stop admitting a guest."""

    def spend(self, client: str, amount: int) -> float:
        """Count bytes to and from a client (identity or host); return the seconds until it may send more."""
        return 0.0

    def may_shake_hands(self, host: str) -> bool:
        """Return whether one more TLS handshake with ``host`` may begin now: each costs as much as 50 requests."""
        return True

    def carries_datagrams(self, address: str) -> bool:
        """Return whether a client can be sent UDP of any port: not through a tunnel, which carries the vendors' own."""
        return True

    def offer(self, server: Server, factory: Callable[[], Protocol]) -> None:
        """Register a door's ``server``; connections to its port get ``factory``'s protocols."""

    def offered(self, port: int) -> tuple[Server, Callable[[], Protocol]] | None:
        """Return what was offered last for ``port``."""
        return None

    def on_gained(self, listener: Callable[[str], None]) -> Callable[[], None]:
        """Call ``listener`` with each identity that gains a right; returns a function that ends this."""
        return lambda: None

    def on_lost(self, listener: Callable[[str], None]) -> Callable[[], None]:
        """Call ``listener`` with each identity that loses a right; returns a function that ends this."""
        return lambda: None
