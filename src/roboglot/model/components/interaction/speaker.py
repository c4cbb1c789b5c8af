"""The loudspeaker."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.sound import Sound

SPEAKER = "speaker"  # the resource that its actions hold
TEXT_MAX = 1000  # characters


class Speaker(Component):
    """Speaks texts and plays sounds one at a time; a new one replaces the current one."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """Volume from 0 (silent) to 1 (loudest)."""

    @abstractmethod
    def set_volume(self, volume: float) -> None:
        """Set the volume. Raises InvalidGoal unless 0..1."""

    @abstractmethod
    def say(self, text: str, *, source: str = "") -> Action:
        """Speak ``text``; the action ends with it, and ``Spoke`` is published.

        Raises InvalidGoal for an empty text or one above TEXT_MAX characters.
        """

    @abstractmethod
    def play(self, sound: Sound, *, source: str = "") -> Action:
        """Play ``sound``; the action ends with it, and ``SoundPlayed`` is published."""
