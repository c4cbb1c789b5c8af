"""The microphone."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.feed import Viewer
from roboglot.model.sound import SoundBlock

BLOCK = 960  # samples: 20 ms


class Microphone(Component):
    """Records only while it has listeners."""

    @abstractmethod
    def subscribe(self) -> Viewer[SoundBlock]:
        """Return a viewer of gapless blocks of BLOCK samples; all listeners share them."""
