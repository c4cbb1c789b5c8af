"""Requirements of a test: world, robots, faults, clock. Read from pytest markers or a class's attributes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from roboglot.config import Config, ConsoleConfig, RecordConfig, RobotConfig, config_of
from roboglot.testing.addresses import free_port
from roboglot.validation import PYTHON, why_invalid
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

    def addresses(self, first: str) -> dict[str, str]:
        """Return the robots' addresses: consecutive ones from ``first`` on."""
        host, _, last = first.rpartition(".")
        return {name: f"{host}.{int(last) + number}" for number, name in enumerate(self.robots)}

    def configuration(self, first: str, data: Path) -> Config:
        """Return the configuration of the program, with every door's section. Raises ValueError."""
        from roboglot.protocols import sections

        body = f"recording:{self.recording}" if self.recording else self.body
        doors: dict[str, object] = {name: {} for name in sections()} | dict(self.doors)
        if isinstance(dog := doors["cyberdog"], Mapping):
            doors["cyberdog"] = {"app": f"127.0.0.1:{free_port()}", **dog}
        values = {"data": str(data), "world": self.world, "seed": self.seed, **doors}
        values |= {"lockstep": True} if self.lockstep else {"speed": self.speed}
        return replace(
            config_of(values, doors=sections()),
            robots=tuple(RobotConfig(name, body, address) for name, address in self.addresses(first).items()),
            console=ConsoleConfig(enabled=False),
            record=RecordConfig(ring=all(map(find_spec, ("mcap", "zstandard", "foxglove_schemas_protobuf")))),
        )

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
                    given["world"] = str(_only_argument(mark))
                values = given | values
            case "body" | "seed" | "recording":
                if mark.kwargs:
                    raise ValueError(f"{mark.name} has no {', '.join(mark.kwargs)}")
                value = _only_argument(mark)
                values.setdefault(mark.name, str(value) if mark.name == "recording" else value)
            case "fault":
                options = dict(mark.kwargs)
                kind, robot = str(_only_argument(mark)), options.pop("robot", None)
                faults.append(WantedFault(kind, robot, tuple(sorted(options.items()))))
    return wanted_of(values, tuple(faults))


def wanted_of(values: Mapping[str, Any], faults: tuple[WantedFault, ...] = ()) -> Wanted:
    """Return the requirements with these values. Raises ValueError for an unknown or wrong one."""
    known = Wanted.__dataclass_fields__.keys() - {"faults"}
    if unknown := values.keys() - known:
        raise ValueError(f"world has no {', '.join(sorted(unknown))}; there are {', '.join(sorted(known))}")
    robots = values.get("robots", ("a",))
    names = (robots,) if isinstance(robots, str) else robots
    if not names:
        raise ValueError("robots names at least one robot")
    try:
        return replace(msgspec.convert(dict(values) | {"robots": names}, Wanted), faults=faults)
    except msgspec.ValidationError as error:
        raise ValueError(why_invalid(error, kinds=PYTHON, wanted=Wanted)) from None


def _only_argument(mark: pytest.Mark) -> object:
    """Return a marker's argument that has no name. Raises ValueError unless there is exactly one."""
    if len(mark.args) != 1:
        raise ValueError(f"{mark.name} takes one value without a name, not {len(mark.args)}")
    argument: object = mark.args[0]
    return argument
