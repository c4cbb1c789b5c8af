"""Verification of passwords, tokens and certificates. Failures count against the host and the given name.

Those from a browser in which this name has logged in before count against that browser alone, so that guesses of others
do not stop a new log-in there: the device cookies of OWASP.
"""

from __future__ import annotations

import asyncio
import time

from roboglot.access.callers import basic_of, host_of
from roboglot.access.identities import Identities
from roboglot.access.secrets import device_fits, new_device, password_fits, token_hash
from roboglot.access.store import IdentityKind
from roboglot.model.admission import LockedOut, Proof, ProofKind, Unknown
from roboglot.transport.limiter import Limiter

PROOFS_MAX = 4096  # clients whose proof is cached
CHECKS_MAX = 16  # passwords waiting to be checked; each check takes 50 ms of a thread
TRIES_SECONDS = 60.0
TRIES_OF_ONE_NAME = 10  # times the limit of one address, so that others' guesses do not lock a person out at once
HTTP, SESSION = ProofKind.HTTP, ProofKind.SESSION  # the class look-up of a member is slower than everything else here
ANYWHERE = "*"  # stands for the host of a proof that is valid from all of them


class Proofs:
    """``logins``: failures allowed to one address per minute."""

    def __init__(self, identities: Identities, logins: int) -> None:
        self._identities = identities
        # By host and header. A password is cached for the host that sent it, as elsewhere the same text is a guess, and
        # for sessions.
        self._owners: dict[tuple[str, str], str] = {}
        self._tries = Limiter(logins / TRIES_SECONDS, logins, time.monotonic)
        often = TRIES_OF_ONE_NAME * logins
        self._tries_of_name = Limiter(often / TRIES_SECONDS, often, time.monotonic)
        self._tries_of_device = Limiter(logins / TRIES_SECONDS, logins, time.monotonic)
        self._checking = asyncio.Semaphore(1)
        self._waiting = 0

    def renew(self, identities: Identities, replaced: set[str]) -> None:
        """Use these identities from now on; forget cached proofs of those in ``replaced``."""
        self._identities = identities
        self._owners = {proof: who for proof, who in self._owners.items() if who not in replaced}

    def known(self, proof: Proof, address: str) -> str | None:
        """Return the owner of a proof if that needs no work, else None."""
        if proof.kind is HTTP:
            return self._owners.get((ANYWHERE, proof.value)) or self._known_password(proof, host_of(address))
        if proof.kind is SESSION:
            return self._owners.get((ANYWHERE, proof.value)) or self._owners.get((SESSION, proof.value))
        return self._certified(proof)

    def _known_password(self, proof: Proof, host: str) -> str | None:
        """Return the owner of a password that this host has sent before, unless too many others failed since.

        Otherwise a locked-out client could go on guessing: only the right password would be answered.
        """
        owner = self._owners.get((host, proof.value))
        return owner if owner is not None and self._tries.has(host) else None

    async def find(self, proof: Proof, host: str) -> str:
        """Return the identity of ``proof`` from ``host``. Raises Unknown, and LockedOut after too many failures."""
        if proof.kind is ProofKind.NONE:
            raise Unknown("say who you are: a name and password, a token, or have your address allowed")
        by_header = proof.kind is HTTP or proof.kind is SESSION
        if (found := self._by_token(proof)) is not None:
            if by_header:
                self._cache(ANYWHERE, proof, found)
        elif by_header:
            found = await self._by_password(proof, host)
        if found is None:
            raise Unknown("this password, token or certificate is not valid")
        return found

    def _cache(self, place: str, proof: Proof, owner: str) -> None:
        if len(self._owners) >= PROOFS_MAX:
            self._owners.pop(next(iter(self._owners)))
        self._owners[place, proof.value] = owner

    def _certified(self, proof: Proof) -> str | None:
        """Return the owner of the certificate, which TLS has verified."""
        certificate = proof.kind is ProofKind.CERTIFICATE
        return proof.value if certificate and self._identities.has(proof.value, IdentityKind.APP) else None

    def _by_token(self, proof: Proof) -> str | None:
        """Return the owner of the certificate or token. They cannot be guessed, so earlier failures do not count."""
        if proof.kind is not HTTP and proof.kind is not SESSION:
            return self._certified(proof)
        scheme, _, rest = proof.value.partition(" ")
        if scheme.lower() == "bearer":
            return self._identities.by_token(token_hash(rest.strip()))
        name, secret = basic_of(proof.value)
        return name if secret and self._identities.by_token(token_hash(secret)) == name else None

    async def _by_password(self, proof: Proof, host: str) -> str | None:
        """Return the owner of this password; a wrong one counts against the host and the name. Raises LockedOut.

        That of a session was right when its cookie was made, and the cookie cannot be guessed: it does not count.
        """
        name, password = basic_of(proof.value)
        counted = proof.kind is HTTP
        counts = self._count(name, host, proof.device) if counted else []
        if not name or not await self._password_fits(name, password):
            return None
        for tries, key in counts:
            tries.give_back(key)
        if counted:
            self._cache(host, proof, name)
        self._cache(SESSION, proof, name)
        return name

    def _count(self, name: str, host: str, device: str) -> list[tuple[Limiter, str]]:
        """Count one try, and return what it counts against. Raises LockedOut."""
        if device_fits(device, name, self._identities.password_of(name)):
            if not self._tries_of_device.take(device):
                raise LockedOut("too many wrong passwords in this browser: wait a minute")
            return [(self._tries_of_device, device)]
        if not self._tries.take(host):
            raise LockedOut("too many wrong passwords and tokens from your address: wait a minute")
        if name and not self._tries_of_name.take(name):
            raise LockedOut(f"too many wrong passwords for {name}: wait a minute, or use a token")
        return [(self._tries, host), (self._tries_of_name, name)]

    def device(self, name: str, shown: str) -> str:
        """See ``Admission.device``."""
        kept = self._identities.password_of(name)
        return shown if device_fits(shown, name, kept) else new_device(name, kept) if kept else ""

    async def _password_fits(self, name: str, password: str) -> bool:
        if self._waiting >= CHECKS_MAX:
            raise Unknown("many passwords are being checked: try again")
        self._waiting += 1
        try:
            async with self._checking:
                kept = self._identities.password_of(name)
                fits = await asyncio.to_thread(password_fits, password, kept)
                return fits and kept == self._identities.password_of(name)  # it may have been replaced meanwhile
        finally:
            self._waiting -= 1
