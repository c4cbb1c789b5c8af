"""The loudspeaker."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.sound import Sound

SPEAKER = "speaker"  # the resource that its actions hold
TEXT_MAX = 1000  # characters


class Speaker(Component):
    """Says texts and plays sounds, one at a time: a new one takes over."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """0 silent to 1 loudest."""

    @abstractmethod
    def set_volume(self, volume: float) -> None:
        """Raises InvalidGoal unless 0..1."""

    @abstractmethod
    def say(self, text: str, *, source: str = "") -> Action:
        """Speak ``text``; ends when it has been said, and then publishes ``Spoke``.

        Raises InvalidGoal if there is nothing to say or more than TEXT_MAX characters.
        """

    @abstractmethod
    def play(self, sound: Sound, *, source: str = "") -> Action:
        """Play ``sound``; ends with it, and then publishes ``SoundPlayed``."""
