"""Events of the hull and the ports: bumpers, cliffs, hits, touches, adapter levels."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboglot.model.events.stream import Event
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.model.components.interaction.armor import HitKind, PlatePlace
    from roboglot.model.components.sensing.touch import TouchKind


@dataclass(frozen=True, slots=True, kw_only=True)
class BumperPressed(Event):
    """Something touched the hull at ``zone``."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BumperReleased(Event):
    """The hull is no longer touched at ``zone``."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CliffDetected(Event):
    """Floor is missing under ``zone``."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CliffCleared(Event):
    """Floor is under ``zone`` again."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmorHit(Event):
    """Something hit the armor plate at ``place``."""

    place: PlatePlace
    kind: HitKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Touched(Event):
    """The touch pad was touched."""

    kind: TouchKind


@dataclass(frozen=True, slots=True, kw_only=True)
class AdapterLevelChanged(Event):
    """The logic level at a sensor adapter's port (both from 1) became ``level``."""

    adapter: int
    port: int
    level: bool
