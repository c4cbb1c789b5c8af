"""The interface of all detectors: each finds one kind of thing, and works only while it has viewers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

from roboglot.model.feed import Viewer
from roboglot.model.perception import Sighting

T = TypeVar("T")


class Detector(ABC, Generic[T]):
    """Runs ``rate`` times per second while it has viewers, and costs nothing otherwise."""

    rate: float

    @abstractmethod
    def subscribe(self) -> Viewer[Sighting[T]]:
        """Return a viewer of its sightings, empty ones included; all viewers share them.

        Closing the last viewer switches the detector off. Raises Busy when there are too many viewers.
        """

    @property
    @abstractmethod
    def latest(self) -> Sighting[T] | None:
        """Latest sighting; None without viewers, and before the first."""
