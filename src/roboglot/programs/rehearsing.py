"""Input and result of a program's rehearsal: plain data. ``roboglot.rehearsal`` plays it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Protocol

from roboglot.model.geometry import Point, Pose, Twist
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Act:
    """Event at ``at`` s: person ``who`` does ``kind`` (say, gesture, walk); touch and box need no person."""

    at: float
    kind: str
    who: str = ""
    text: str = ""
    to: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Scene:
    """A world with the poses of robot, boxes and people (m, rad). ``longest``: most robot time that it lasts, s."""

    world: str = "empty"
    body: str = "cyberdog2"
    start: Pose | None = None
    boxes: tuple[tuple[Pose, tuple[float, float, float]], ...] = ()
    people: tuple[tuple[str, Pose], ...] = ()
    acts: tuple[Act, ...] = ()
    longest: float = 120.0
    seed: int = 7


@dataclass(frozen=True, slots=True)
class Spot:
    """True pose of the robot: seconds since the start, m, rad."""

    at: float
    x: float
    y: float
    yaw: float


@dataclass(frozen=True, slots=True)
class Refusal:
    """A call that was answered with a failure: its line in ``module`` or in the program, and the robot's words."""

    function: str
    line: int
    module: str
    words: str


@dataclass(slots=True)
class Played:
    """Record of a program.

    ``error`` is empty if the program finished, else ``line`` is where in its own text (0: in a module). ``late``:
    it was ended because it took too long.
    ``outlines``: walls and furniture on the robot's floor. ``colours``: zone and red, green, blue of every state of
    the lights. ``said``: texts and names of sounds. ``refused``: the first calls that were answered with a failure.
    """

    printed: str = ""
    said: list[str] = field(default_factory=list)
    calls: list[tuple[str, tuple[object, ...]]] = field(default_factory=list)
    refused: list[Refusal] = field(default_factory=list)
    blocks: list[str] = field(default_factory=list)
    colours: set[tuple[str, int, int, int]] = field(default_factory=set)
    path: list[Spot] = field(default_factory=list)
    outlines: list[Sequence[Point]] = field(default_factory=list)
    posture: str = ""
    seconds: float = 0.0
    error: str = ""
    line: int = 0
    late: bool = False


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a plan: drive to ``goal`` (frame: base_link at the plan's start), or at ``twist`` for ``seconds``."""

    goal: Point | None = None
    twist: Twist | None = None
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Hit:
    """Contact of the hull: seconds since the start, true position of the robot (m), name of the object."""

    at: float
    x: float
    y: float
    what: str


@dataclass(slots=True)
class Tried:
    """Result of a plan: outcome of each step up to the first failure, and contacts of the hull."""

    steps: list[tuple[str, str]] = field(default_factory=list)  # SUCCEEDED or ABORTED, and the reason
    hits: list[Hit] = field(default_factory=list)
    path: list[Spot] = field(default_factory=list)
    seconds: float = 0.0
    late: bool = False


class Rehearse(Protocol):
    """Plays a program or a plan in a copy of a world."""

    async def try_plan(self, steps: Sequence[Step], scene: Scene) -> Tried:
        """Do the steps in turn, as fast as possible. Raises as ``play`` does."""

    async def play(
        self,
        source: str,
        scene: Scene,
        *,
        modules: Mapping[str, str] | None = None,
        speed: float = 10.0,
        notice: Callable[[dict[str, object]], None] | None = None,
    ) -> Played:
        """Play to the end. Raises ValueError for an impossible scene, RuntimeError if too many rehearsals wait."""


SceneOf = Callable[[str], Scene]
"""Return the current scene around the named robot. Raises ValueError if it is not simulated."""
