"""Settings of the robot that survive restarts."""

from __future__ import annotations

import logging
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

from roboglot.model.components.component import Component
from roboglot.model.errors import RobotError

log = logging.getLogger(__name__)


class Settings(Component):
    """JSON values by key ("slamware.language"). An acknowledged change survives a crash."""

    @abstractmethod
    def get(self, key: str, default: Any = None) -> Any:
        """Return the value, or ``default`` if never set."""

    @abstractmethod
    async def put_all(self, values: Mapping[str, object]) -> None:
        """Set values, all or none; return once they are on disk."""

    async def put(self, key: str, value: object) -> None:
        """Set a value; return once it is on disk."""
        await self.put_all({key: value})

    async def keep(self, key: str, value: object) -> None:
        """Set what no client waits for: where that fails, the log says so."""
        try:
            await self.put(key, value)
        except RobotError as error:
            log.warning("cannot store %s: %s", key, error)
