"""Durable documents: orders, templates, calls. Knows nothing of their content."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence

from roboglot.model.components.component import Component


class Ledger(Component):
    """JSON documents by kind ("order") and id. An acknowledged change survives a crash."""

    @abstractmethod
    def all(self, kind: str) -> Sequence[tuple[str, object]]:
        """Return ids and documents of a kind, in the order of their first appearance."""

    @abstractmethod
    async def write(self, kind: str, documents: Mapping[str, object], *, forget: Sequence[str] = ()) -> None:
        """Add or replace ``documents`` and delete the ids in ``forget``, atomically; return once on disk."""
