"""Transport in a plant: templates of rounds, and calls that people send from calling stations."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.model.components.logistics.delivery import OrderStatus
from roboglot.values import dataclass


class CallKind(StrEnum):
    """Kind of a call: to come, or to do the round of a template."""

    PLAIN = "plain"  # come to the calling station
    BY_TEMPLATE = "by template"  # do the round described by a template


@dataclass(frozen=True, slots=True)
class Operation:
    """Operation at the place of that name: ``action`` (free text, done by people or a client), then wait (s)."""

    place: str
    action: str = ""
    wait_seconds: int = 0


@dataclass(frozen=True, slots=True)
class RoundTemplate:
    """A round that can be called by its ``key``."""

    key: str
    name: str
    operations: tuple[Operation, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """A call and its outcome; times in seconds since 1970, ``began_at`` 0 before it began."""

    id: str
    number: str
    kind: CallKind
    target: str
    template: str = ""
    operations: tuple[Operation, ...] = ()
    status: OrderStatus = OrderStatus.READY
    reason: str = ""
    began_at: float = 0.0
    changed_at: float = 0.0


class Industry(Component):
    """Templates and calls; both survive crashes. The client that carries out a call reports its progress."""

    @property
    @abstractmethod
    def templates(self) -> Sequence[RoundTemplate]:
        """Templates in the order they were made."""

    @abstractmethod
    async def put_template(self, template: RoundTemplate) -> None:
        """Add or replace. NotFound for a place that is not on the map; Refused beyond ``TEMPLATES_MAX``."""

    @abstractmethod
    async def remove_template(self, key: str) -> None:
        """Delete a template. Raises NotFound."""

    @property
    @abstractmethod
    def calls(self) -> Sequence[Call]:
        """Open calls and the last ended ones, oldest first."""

    @abstractmethod
    async def call(self, kind: CallKind, target: str, *, template: str = "") -> Call:
        """Add a call. Raises NotFound for an unknown place or template; Refused when too many wait."""

    @abstractmethod
    async def report(self, id: str, status: OrderStatus, reason: str = "") -> Call:
        """Report a call as running, succeeded or failed. Raises NotFound; Refused if it has ended."""
