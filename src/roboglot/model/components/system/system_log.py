"""The robot's log of itself, and its upload to the maker on request."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.values import dataclass

SYSTEM_LOG = "system log"  # the resource of an upload
LINES_MAX = 2000
LINE_MAX = 300  # characters


@dataclass(frozen=True, slots=True)
class Upload:
    """Receipt of the maker's server: robot time, s; size in bytes; SHA-256 of the text in hex."""

    stamp: float
    size: int
    digest: str


class SystemLog(Component):
    """A line for every event but the frequent ones, with robot time; the last LINES_MAX are kept."""

    @property
    @abstractmethod
    def lines(self) -> Sequence[str]:
        """Oldest first."""

    @property
    @abstractmethod
    def uploads(self) -> Sequence[Upload]:
        """Since the robot is on, oldest first."""

    @abstractmethod
    def upload(self, *, source: str = "") -> Action:
        """Send the lines to the maker. Aborts with Refused when the internet is not reached, or lost on the way."""
