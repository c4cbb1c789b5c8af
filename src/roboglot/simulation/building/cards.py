"""Flat squares in the world, and the codes printed on them."""

from __future__ import annotations

from roboglot.model.geometry import Pose
from roboglot.model.perception import TagKind
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Card:
    """A flat square: ``pose`` in world, +x out of it; ``height`` of its middle above the floor, and ``size``, m."""

    pose: Pose
    height: float
    size: float


@dataclass(frozen=True, slots=True)
class PrintedTag:
    """A card and the code printed on it."""

    kind: TagKind
    text: str
    card: Card
