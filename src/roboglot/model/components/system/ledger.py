"""Documents that must not be forgotten: orders, templates, calls. Knows nothing of what is in them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence

from roboglot.model.components.component import Component


class Ledger(Component):
    """JSON documents by kind ("order") and id. What was acknowledged survives a crash."""

    @abstractmethod
    def all(self, kind: str) -> Sequence[tuple[str, object]]:
        """Ids and documents of the kind, in the order in which their ids first came."""

    @abstractmethod
    async def write(self, kind: str, documents: Mapping[str, object], *, forget: Sequence[str] = ()) -> None:
        """Add or replace ``documents`` and drop the ids in ``forget``, all or nothing; returns when safe on disk."""
