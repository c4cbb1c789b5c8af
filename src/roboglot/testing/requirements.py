"""Requirements of a test: world, robots, faults, clock. Read from pytest markers or a class's attributes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from roboglot.config import RobotConfig
from roboglot.values import dataclass

if TYPE_CHECKING:
    import pytest

SPEED = 4.0  # seconds of robot time per second of the test


@dataclass(frozen=True, slots=True)
class WantedFault:
    """A fault that is active from the start of the test; ``robot`` None: every robot with that part."""

    kind: str
    robot: str | None = None
    options: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class Wanted:
    """One world with its robots. ``recording``: file whose answers the robots give. ``shared``: by several tests."""

    world: str = "office"
    robots: tuple[str, ...] = ("a",)
    body: str = "universal"
    seed: int = 1
    speed: float = SPEED
    lockstep: bool = False
    shared: bool = False
    recording: str = ""
    faults: tuple[WantedFault, ...] = ()
    doors: Mapping[str, object] = field(default_factory=dict, hash=False)

    def configs(self, first: str) -> tuple[RobotConfig, ...]:
        """Return the robots' configurations at consecutive addresses from ``first`` on."""
        body = f"recording:{self.recording}" if self.recording else self.body
        host, _, last = first.rpartition(".")
        return tuple(RobotConfig(name, body, f"{host}.{int(last) + number}") for number, name in enumerate(self.robots))

    @property
    def place(self) -> Wanted:
        """Requirements without faults, which a running server can get later."""
        return replace(self, faults=())


def wanted_by(markers: Iterable[pytest.Mark]) -> Wanted:
    """Read the markers of a test, the nearest first. Raises ValueError for unknown values."""
    values: dict[str, object] = {}
    faults: list[WantedFault] = []
    for mark in markers:
        match mark.name:
            case "world":
                given: dict[str, object] = dict(mark.kwargs)
                if mark.args:
                    given["world"] = str(mark.args[0])
                values = given | values
            case "body" | "seed" | "recording":
                values.setdefault(mark.name, str(mark.args[0]) if mark.name != "seed" else int(mark.args[0]))
            case "fault":
                options = dict(mark.kwargs)
                faults.append(
                    WantedFault(str(mark.args[0]), options.pop("robot", None), tuple(sorted(options.items())))
                )
    return wanted_of(values, tuple(faults))


def wanted_of(values: Mapping[str, Any], faults: tuple[WantedFault, ...] = ()) -> Wanted:
    """Return the requirements with these values. Raises ValueError for an unknown or wrong one."""
    known = Wanted.__dataclass_fields__.keys() - {"faults"}
    if unknown := values.keys() - known:
        raise ValueError(f"world has no {', '.join(sorted(unknown))}; there are {', '.join(sorted(known))}")
    robots = values.get("robots", ("a",))
    names = (robots,) if isinstance(robots, str) else tuple(robots)
    if not names:
        raise ValueError("robots names at least one robot")
    return Wanted(**(dict(values) | {"robots": names}), faults=faults)
