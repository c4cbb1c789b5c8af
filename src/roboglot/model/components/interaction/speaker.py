"""The loudspeaker."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal
from roboglot.model.sound import Sound

SPEAKER = "speaker"  # the resource that its actions hold
TEXT_MAX = 1000  # characters


def check_volume(volume: float) -> None:
    """Raise InvalidGoal unless 0..1."""
    if not 0.0 <= volume <= 1.0:
        raise InvalidGoal(f"the volume is 0 to 1, not {volume:g}")


def check_text(text: str) -> None:
    """Raise InvalidGoal for an empty text, or one that is too long to say."""
    if not text.strip() or len(text) > TEXT_MAX:
        raise InvalidGoal(f"a text to say has 1 to {TEXT_MAX} characters")


class Speaker(Component):
    """Speaks texts and plays sounds one at a time; a new one replaces the current one."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """Volume from 0 (silent) to 1 (loudest)."""

    @abstractmethod
    async def set_volume(self, volume: float) -> None:
        """Set the volume; return once it is stored. Raises InvalidGoal unless 0..1."""

    @abstractmethod
    def say(self, text: str, *, source: str = "") -> Action:
        """Speak ``text``; the action ends with it, and ``Spoke`` is published.

        Raises InvalidGoal for an empty text or one above TEXT_MAX characters.
        """

    @abstractmethod
    def play(self, sound: Sound, *, source: str = "") -> Action:
        """Play ``sound``; the action ends with it, and ``SoundPlayed`` is published."""
