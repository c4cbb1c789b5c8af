"""Events of the robot's equipment: blaster, loudspeaker, cargo boxes, jack."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboglot.model.events.stream import Event
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.model.components.logistics.cargo import BoxState


@dataclass(frozen=True, slots=True, kw_only=True)
class BeadFired(Event):
    """A bead left the muzzle; ``ammo`` are left in the magazine."""

    ammo: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Spoke(Event):
    """The loudspeaker has said ``text``, which took ``seconds``; not ``audible``: there was no voice to speak it."""

    text: str
    seconds: float
    audible: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SoundPlayed(Event):
    """The loudspeaker has played the sound of that name."""

    name: str
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxChanged(Event):
    """A cargo box's door, lock, content or errors changed."""

    box: BoxState


@dataclass(frozen=True, slots=True, kw_only=True)
class JackChanged(Event):
    """The jack reached another stage (a ``JackStage`` value), took or lost a load, or raised an ``alarm``."""

    stage: str
    alarm: str
