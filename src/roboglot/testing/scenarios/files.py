"""Scenario files: their format, read strictly; ``schema`` returns it as a JSON schema for editors."""

from __future__ import annotations

import dataclasses
import inspect
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec

from roboglot.spelling import instead
from roboglot.testing.requirements import SPEED, Wanted, WantedFault
from roboglot.text_files import in_bounds, text_of
from roboglot.validation import why_invalid
from roboglot.values import dataclass

BYTES_MAX = 1 << 20
Seconds = Annotated[float, msgspec.Meta(gt=0, le=86_400)]
Meters = Annotated[float, msgspec.Meta(ge=-10_000, le=10_000)]
Count = Annotated[int, msgspec.Meta(ge=0)]


class BadScenario(ValueError):
    """The file is not a scenario; the message says where and why."""


class _Strict(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of structs that refuse unknown fields."""


class Given(_Strict, frozen=True, forbid_unknown_fields=True):
    """The world, its robots and initial faults; as in the test kit's marker ``world``."""

    world: str = "office"
    robots: Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=16)] = ("a",)
    body: str = "universal"
    seed: int = 1
    speed: Annotated[float, msgspec.Meta(gt=0, le=100)] = SPEED
    lockstep: bool = False
    recording: str = ""
    faults: tuple[str | dict[str, Any], ...] = ()
    doors: dict[str, Any] = {}

    def wanted(self, folder: Path) -> Wanted:
        """Return the requirements for a server; paths are relative to ``folder``. Raises BadScenario."""
        world = str(folder / self.world) if self.world.endswith((".toml", ".yaml")) else self.world
        recording = str(folder / self.recording) if self.recording else ""
        faults = tuple(map(fault_of, self.faults))
        values = {field.name: getattr(self, field.name) for field in msgspec.structs.fields(Given)}
        return Wanted(**(values | {"world": world, "recording": recording, "faults": faults}))


class Placing(_Strict, frozen=True, forbid_unknown_fields=True):
    """Place to put a robot at: m and degrees in the world's frame."""

    x: Meters
    y: Meters
    degrees: float = 0.0
    robot: str = ""


class Box(_Strict, frozen=True, forbid_unknown_fields=True):
    """A box to put into the world, m."""

    x: Meters
    y: Meters
    width: float = 0.4
    depth: float = 0.4
    height: float = 1.0


class Place(_Strict, frozen=True, forbid_unknown_fields=True):
    """Expected place of a robot: in the world (``pose``) or from its start (``moved``); m and degrees."""

    x: Meters | None = None
    y: Meters | None = None
    degrees: float | None = None
    within: Annotated[float, msgspec.Meta(gt=0)] = 0.1
    within_degrees: Annotated[float, msgspec.Meta(gt=0)] = 5.0
    robot: str = ""


class Visits(_Strict, frozen=True, forbid_unknown_fields=True):
    """Places [x, y] in the world (m) that a robot must have visited, in this order."""

    places: Annotated[tuple[tuple[float, float], ...], msgspec.Meta(min_length=1)]
    within: Annotated[float, msgspec.Meta(gt=0)] = 0.3
    robot: str = ""


class Range(_Strict, frozen=True, forbid_unknown_fields=True):
    """Bounds of a number."""

    at_least: float | None = None
    at_most: float | None = None
    robot: str = ""


class Exchanged(_Strict, frozen=True, forbid_unknown_fields=True):
    """Expected number of requests by door, operation and status; empty: any."""

    door: str = ""
    operation: str = ""
    status: str = ""
    at_least: Count = 1
    at_most: Count | None = None
    robot: str = ""


class Check(_Strict, frozen=True, forbid_unknown_fields=True):
    """One thing that must be true; exactly one of its fields is given.

    ``travelled``: metres driven; ``battery``: percent; ``faults``: exactly the robot's own; ``refused``: maximum number
    of refused requests; ``printed``: a text that a program or command printed.
    """

    pose: Place | None = None
    moved: Place | None = None
    visited: Visits | None = None
    travelled: Range | None = None
    battery: Range | None = None
    faults: tuple[str, ...] | None = None
    exchanged: Exchanged | None = None
    refused: Count | None = None
    printed: str | None = None


class Step(_Strict, frozen=True, forbid_unknown_fields=True):
    """One thing that happens; exactly one of ``STEPS`` is given, the rest belongs to it.

    ``run``: a command of the shell that must end with 0 within ``within`` real seconds; its variables ROBOGLOT_ADDRESS,
    ROBOGLOT_URL, ROBOGLOT_PROGRAMS, ROBOGLOT_CERTIFICATES and ROBOGLOT_APP_PORT point to the robot. ``rest``: a
    request ("GET /path") with ``body``, expecting ``status`` and an ``answer`` with at least these fields. ``text``: a
    command of the text protocol, expecting ``answer``. ``dog``: a code of the app protocol with ``body`` as its
    parameters, expecting ``answer`` among its answers. ``program``: a file with a block program. ``wait``: s of robot
    time. ``until``: something that must become true ``within`` s of robot time.
    """

    run: str | None = None
    rest: str | None = None
    text: str | None = None
    dog: int | None = None
    program: str | None = None
    fault: str | dict[str, Any] | None = None
    clear_faults: bool | None = None
    place: Placing | None = None
    box: Box | None = None
    wait: Seconds | None = None
    until: Check | None = None
    within: Seconds = 60.0
    body: Any = None
    status: int | None = None
    answer: Any = None
    robot: str = ""


STEPS = ("run", "rest", "text", "dog", "program", "fault", "clear_faults", "place", "box", "wait", "until")
CHECKS = tuple(field.name for field in msgspec.structs.fields(Check))


class Scenario(_Strict, frozen=True, forbid_unknown_fields=True):
    """One test: ``given`` a world, ``when`` these steps are done in order, ``then`` all of these checks hold."""

    name: str
    when: tuple[Step, ...]
    then: Annotated[tuple[Check, ...], msgspec.Meta(min_length=1)]
    given: Given = Given()
    about: str = ""


@dataclass(frozen=True, slots=True)
class Found:
    """A scenario and its file."""

    path: Path
    scenario: Scenario


def with_seed(found: Found, seed: int) -> Found:
    """Return the scenario with another seed."""
    given = msgspec.structs.replace(found.scenario.given, seed=seed)
    return dataclasses.replace(found, scenario=msgspec.structs.replace(found.scenario, given=given))


def fault_of(value: str | Mapping[str, Any]) -> WantedFault:
    """Return the fault of a file: its name, or a mapping with ``kind``, ``robot`` and options. Raises BadScenario."""
    if isinstance(value, str):
        return WantedFault(value)
    options = dict(value)
    if not isinstance(kind := options.pop("kind", None), str):
        raise BadScenario("a fault needs a kind")
    robot = options.pop("robot", None)
    return WantedFault(kind, robot, tuple(sorted(options.items())))


def verb_of(value: Step | Check, verbs: Sequence[str]) -> str:
    """Return the only one of ``verbs`` that is given. Raises BadScenario."""
    given = [verb for verb in verbs if getattr(value, verb) is not None]
    if len(given) != 1:
        raise BadScenario(f"one of {', '.join(verbs)} is needed, not {' and '.join(given) or 'none'}")
    return given[0]


def read(path: Path) -> Found:
    """Read one file. Raises BadScenario."""
    from roboglot.testing.scenarios.strict_yaml import read_yaml

    try:
        with in_bounds():
            values = read_yaml(text_of(path, BYTES_MAX))
        if isinstance(values, dict):
            values.pop("$schema", None)
        scenario = msgspec.convert(values, Scenario)
        _check(scenario)
        scenario.given.wanted(path.parent)
    except (OSError, ValueError, BadScenario) as error:
        spoken = isinstance(error, OSError) and error.strerror
        why = spoken or why_invalid(error, "the file", wanted=Scenario)
        raise BadScenario(f"{path}: {' '.join(why.split())}") from None
    return Found(path, scenario)


def _check(scenario: Scenario) -> None:
    """Raise BadScenario for errors across fields, which a schema cannot express."""
    parts: list[tuple[str, Step | Check, Sequence[str]]] = []
    for number, step in enumerate(scenario.when, 1):
        parts.append((f"when {number}", step, STEPS))
        if step.until is not None:
            parts.append((f"when {number}: until", step.until, CHECKS))
    parts += [(f"then {number}", check, CHECKS) for number, check in enumerate(scenario.then, 1)]
    for where, part, verbs in parts:
        try:
            value = getattr(part, verb_of(part, verbs))
        except BadScenario as error:
            raise BadScenario(f"{where}: {error}") from None
        if needed := _lacks(value):
            raise BadScenario(f"{where}: {needed} is needed: without, nothing is checked")
        for robot in {getattr(part, "robot", ""), getattr(value, "robot", "")} - {"", *scenario.given.robots}:
            raise BadScenario(f"{where}: there is no robot {robot!r}{instead(robot, scenario.given.robots)}")


def _lacks(value: object) -> str:
    """Return what an expectation needs that would hold for any value; "" for others."""
    match value:
        case Range(at_least=None, at_most=None):
            return "at_least or at_most"
        case Place(x=None, y=None, degrees=None):
            return "x, y or degrees"
        case Exchanged(at_least=0, at_most=None):
            return "at_most, or at_least above 0,"
        case "":
            return "a text"
    return ""


def shown_below(path: Path) -> Iterator[Path]:
    """Yield the files below a folder that are not hidden; ``path`` itself if it is a file."""
    if not path.is_dir():
        yield path
    for folder, inside, names in os.walk(path):
        inside[:] = [name for name in inside if not name.startswith(".")]
        yield from (Path(folder, name) for name in names if not name.startswith("."))


def find(paths: Sequence[Path]) -> Sequence[Found]:
    """Read files, and all ``*.yaml`` and ``*.yml`` below folders. Raises BadScenario, also if there are none.

    Hidden files and folders (``.venv``, ``.git``) are left out unless they are named.
    """
    files: list[Path] = []
    for path in paths:
        found = shown_below(path)
        files += sorted(file for file in found if file == path or file.suffix in (".yaml", ".yml"))
    if not files:
        raise BadScenario(f"no scenario in {', '.join(map(str, paths))}")
    return [read(file) for file in files]


def schema() -> dict[str, object]:
    """Return the JSON schema (2020-12) of a scenario file."""
    made = msgspec.json.schema(Scenario)
    for name, verbs in (("Step", STEPS), ("Check", CHECKS)):
        made["$defs"][name]["oneOf"] = [{"required": [verb]} for verb in verbs]
    made["$defs"]["Scenario"]["properties"]["$schema"] = {"type": "string"}
    for kind in made["$defs"].values():
        if "description" in kind:  # a docstring, which Python indents before 3.13
            kind["description"] = inspect.cleandoc(kind["description"])
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "roboglot scenario"} | made
