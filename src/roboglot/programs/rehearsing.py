"""Input and result of a program's rehearsal: plain data. ``roboglot.rehearsal`` plays it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from roboglot.model.geometry import Point, Pose, Twist


@dataclass(frozen=True, slots=True)
class Act:
    """Event ``at`` so many seconds: ``who`` does ``kind`` (say, gesture, walk; touch and box need no one)."""

    at: float
    kind: str
    who: str = ""
    text: str = ""
    to: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Scene:
    """A world, and what is where in it; m and rad. ``longest``: seconds of robot time after which it is over."""

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


@dataclass(slots=True)
class Played:
    """Record of a program.

    ``error`` is empty if it came to its end; ``late``: it was ended for taking too long.
    ``outlines``: of walls and furniture on its floor. ``colours``: zone and red, green, blue of every look of the
    lights. ``said``: texts and names of sounds.
    """

    printed: str = ""
    said: list[str] = field(default_factory=list)
    calls: list[tuple[str, tuple[object, ...]]] = field(default_factory=list)
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
    """One step of a plan: drive to ``goal`` (base_link at the plan's start), or with ``twist`` for ``seconds``."""

    goal: Point | None = None
    twist: Twist | None = None
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Hit:
    """The hull touched something: seconds since the start, where the robot really was, what it was."""

    at: float
    x: float
    y: float
    what: str


@dataclass(slots=True)
class Tried:
    """Result of a plan: the end of each step (the first that fails is the last), and what the robot touched."""

    steps: list[tuple[str, str]] = field(default_factory=list)  # SUCCEEDED or ABORTED, and why
    hits: list[Hit] = field(default_factory=list)
    path: list[Spot] = field(default_factory=list)
    seconds: float = 0.0
    late: bool = False


class Rehearse(Protocol):
    """Plays a program or a plan in a copy of a world."""

    async def try_plan(self, steps: Sequence[Step], scene: Scene) -> Tried:
        """Do the steps in turn, as fast as it goes. Raises as ``play`` does."""

    async def play(
        self,
        source: str,
        scene: Scene,
        *,
        modules: Mapping[str, str] | None = None,
        speed: float = 10.0,
        notice: Callable[[dict[str, object]], None] | None = None,
    ) -> Played:
        """Play to the end. Raises ValueError for a scene that cannot be, RuntimeError where too many wait."""


SceneOf = Callable[[str], Scene]
"""The scene around a robot as it is now, by its name. Raises ValueError where it is not simulated."""
