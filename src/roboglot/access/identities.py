"""Identities and their rights in memory: looked up at every request, rebuilt when the list changes."""

from __future__ import annotations

from collections.abc import Iterable

from roboglot.access.rights import ALL_ROBOTS, EVERYTHING, NOTHING, effective
from roboglot.access.store import Identity, IdentityKind
from roboglot.operations import Right

LOCAL = "local"  # the identity of local programs where no credentials are needed

Rights = dict[str, frozenset[Right]]  # by identity


class Identities:
    """All identities at one instant."""

    def __init__(self, identities: Iterable[Identity]) -> None:
        self._identities = {identity.name: identity for identity in identities}
        self._tokens = {entry.token: entry.name for entry in self._identities.values() if entry.token}

    def by_token(self, kept: str) -> str | None:
        """Return the owner of the token with this hash."""
        return self._tokens.get(kept)

    def password_of(self, name: str) -> str:
        """Return the stored form of a person's password; empty if there is no such person."""
        identity = self._identities.get(name)
        return identity.password if identity is not None and identity.kind is IdentityKind.PERSON else ""

    def has(self, name: str, kind: IdentityKind) -> bool:
        """Return whether an identity of this name and kind exists."""
        identity = self._identities.get(name)
        return identity is not None and identity.kind is kind

    def rights(self, robot: str, now: float, *, local: bool) -> Rights:
        """Return the rights on ``robot`` by identity at ``now`` (Unix s)."""
        found: Rights = {LOCAL: EVERYTHING} if local else {}
        for identity in self._identities.values():
            valid = [
                grant
                for grant in identity.grants
                if grant.robot in (robot, ALL_ROBOTS) and (grant.until is None or now < grant.until)
            ]
            found[identity.name] = effective(right for grant in valid for right in grant.rights) if valid else NOTHING
        return found

    def next_end(self, now: float) -> float:
        """Return the time (Unix s) at which the next right ends; infinity if none does."""
        ends = [grant.until for identity in self._identities.values() for grant in identity.grants]
        return min((end for end in ends if end is not None and end > now), default=float("inf"))

    def replaced(self, older: Identities) -> set[str]:
        """Return identities that are gone or have another password or token than in ``older``; their proofs end."""
        return {
            name
            for name, before in older._identities.items()
            if (after := self._identities.get(name)) is None
            or (before.kind, before.password, before.token) != (after.kind, after.password, after.token)
        }
