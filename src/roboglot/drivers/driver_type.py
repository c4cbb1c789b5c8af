"""Driver types: a scheme of URLs, their options, and the function that makes the driver."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import field
from typing import TypeVar, cast

from roboglot.drivers.driver import Driver
from roboglot.model.components.component import Component
from roboglot.model.robot import Robot
from roboglot.values import dataclass

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Target:
    """Address of a real robot: the parts of its URL, with options that its driver knows."""

    url: str
    host: str
    port: int | None
    options: Mapping[str, str]

    def port_option(self, name: str, default: int) -> int:
        """Return the port number in option ``name``. Raises ValueError."""
        text = self.options.get(name, str(default))
        if not text.isascii() or not text.isdigit() or int(text) > 65_535:
            raise ValueError(f"{self.url}: {name} is a port")
        return int(text)


@dataclass(frozen=True, slots=True)
class Workshop:
    """State shared by the drivers of one program. Without ``touches`` robots are only observed.

    ``own``: addresses of the program's own doors, which discovery ignores.
    """

    own: Collection[str] = ()
    touches: bool = True
    _shared: dict[Hashable, object] = field(default_factory=dict)

    def shared(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return the object of this key, made at the first call: a UDP port, for one, can be bound only once."""
        if key not in self._shared:
            self._shared[key] = make()
        return cast(T, self._shared[key])


@dataclass(frozen=True, slots=True)
class DriverType:
    """One driver. It is imported at every start: ``make`` and ``announced`` import what they need.

    ``make`` adds the components to the bare robot; it raises ValueError for a bad URL. ``announced``: the components
    that such a robot has or may have, each with a plain description of what is approximate about it, or "".
    ``example``: options without which a URL is refused.
    """

    scheme: str
    make: Callable[[Workshop, Robot, Target], Driver]
    announced: Callable[[], Mapping[type[Component], str]] = dict
    options: frozenset[str] = frozenset()
    example: str = ""
