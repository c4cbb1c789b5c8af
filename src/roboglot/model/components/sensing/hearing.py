"""What the robot understands of the sounds that its microphone hears."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.feed import Viewer
from roboglot.model.perception import ClapsHeard, SpeechHeard


class Hearing(Component):
    """Listens only while somebody wants to know."""

    @abstractmethod
    def claps(self) -> Viewer[ClapsHeard]:
        """Runs of claps from now on, told once a run is over."""

    @abstractmethod
    def speech(self) -> Viewer[SpeechHeard]:
        """What others say from now on, told shortly after each utterance; the robot's own voice is left out.

        Voices are named after the robot's members.
        """
