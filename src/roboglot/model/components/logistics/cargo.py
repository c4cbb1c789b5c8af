"""Cargo compartments: boxes with motor-driven, locked doors."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum

from roboglot.model.action import Action
from roboglot.model.components.component import Component
from roboglot.values import dataclass

BOX = "box "  # prefix of the resources of its doors


class DoorState(StrEnum):
    """State of a box's door."""

    OPEN = "open"
    OPENING = "opening"
    CLOSING = "closing"
    CLOSED = "closed"
    HALF_OPEN = "half open"  # stopped between the ends


class Stock(StrEnum):
    """Content of a box as its sensor reports it."""

    EMPTY = "empty"
    PARTLY = "partly"
    FULL = "full"


@dataclass(frozen=True, slots=True)
class BoxState:
    """Current state of one box; ``errors`` in plain words."""

    id: int
    door: DoorState
    locked: bool
    stock: Stock
    errors: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Compartment:
    """A group of boxes: ``orientation`` front, back or top; ``layer`` from below; ``kind`` takeout or retail."""

    id: str
    position: int
    orientation: str
    layer: int
    kind: str
    boxes: tuple[int, ...]


class Cargo(Component):
    """All compartments. Box ids are unique on the robot. Publishes ``BoxChanged``."""

    compartments: Sequence[Compartment]

    @abstractmethod
    def box(self, id: int) -> BoxState:
        """Return a box. Raises NotFound."""

    @abstractmethod
    def open_box(self, id: int, *, source: str = "") -> Action:
        """Unlock and open; the action holds the box. Aborts with Blocked when the door stalls. Raises NotFound."""

    @abstractmethod
    def close_box(self, id: int, *, source: str = "") -> Action:
        """Close and lock; aborts with Blocked when something is in the door, which then reopens slightly."""
