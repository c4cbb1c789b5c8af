"""A setting that a real robot does not report: one sent counts at once, a refused one gives way to the robot's."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

from roboglot.drivers.supervisor import Supervisor

T = TypeVar("T")


class Setting(Generic[T]):
    """The last ``value`` sent; if it is refused, the last one that the robot has confirmed."""

    def __init__(self, supervisor: Supervisor, value: T) -> None:
        self._supervisor = supervisor
        self.value = self._confirmed = value
        self._sent = 0

    def read(self, value: T) -> None:
        """Take over the robot's own value."""
        self.value = self._confirmed = value

    def send(self, what: str, value: T, command: Callable[[], Awaitable[None]]) -> None:
        """Send ``value`` by ``command`` without waiting. Raises what ``Supervisor.require`` does."""
        number = self._sent + 1

        async def send() -> None:
            await command()
            self._confirmed = value

        def undo() -> None:
            if self._sent == number:  # else a later one counts
                self.value = self._confirmed

        self._supervisor.send_setting(what, send, undo)
        self._sent, self.value = number, value
