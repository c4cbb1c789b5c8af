"""Hearing: sounds that the robot recognizes with its microphone."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.feed import Viewer
from roboglot.model.perception import ClapsHeard, SpeechHeard


class Hearing(Component):
    """Listens only while it has viewers."""

    @abstractmethod
    def claps(self) -> Viewer[ClapsHeard]:
        """Return a viewer of runs of claps, each reported when it is over."""

    @abstractmethod
    def speech(self) -> Viewer[SpeechHeard]:
        """Return a viewer of utterances, each reported shortly after its end; the robot's own voice is left out.

        Voices are named after the robot's members.
        """
