"""Apps that people installed on the robot."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import BinaryIO

from roboglot.model.components.component import Component
from roboglot.values import dataclass

APPS_MAX = 50
APP_BYTES_MAX = 500 * 1000**2


@dataclass(frozen=True, slots=True)
class App:
    """``name`` as its package says, ``size`` in bytes, ``installed_at`` in seconds since 1970."""

    name: str
    version: str
    size: int
    installed_at: float


class Apps(Component):
    """Store of apps; the robot does not run them. An acknowledged change survives a crash."""

    @abstractmethod
    def all(self) -> Sequence[App]:
        """Apps by name."""

    @abstractmethod
    async def install(self, name: str, version: str, package: BinaryIO) -> App:
        """Install an app, replacing one of the same name. Raises InvalidGoal (name, size, too many) or Refused."""

    @abstractmethod
    async def remove(self, name: str) -> None:
        """Delete an app. Raises NotFound."""
