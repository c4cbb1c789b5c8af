"""The interface of all detectors: each finds one kind of thing, and works only while it has viewers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

from roboglot.model.feed import Viewer
from roboglot.model.perception import Sighting

T = TypeVar("T")


class Detector(ABC, Generic[T]):
    """Looks ``rate`` times a second while it has viewers, and costs nothing otherwise."""

    rate: float

    @abstractmethod
    def subscribe(self) -> Viewer[Sighting[T]]:
        """Return what it makes out from now on, also when that is nothing; the same for every viewer.

        Closing the viewer switches the detector off, if it was the last. Raises Busy when there are too many.
        """

    @property
    @abstractmethod
    def latest(self) -> Sighting[T] | None:
        """The newest sighting; None without viewers, and before the first."""
