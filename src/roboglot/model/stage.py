"""Stage: control of a simulated world. Moves robots, things and people, makes sounds, injects faults.

For consoles, test kits and agents; ``simulation.world.stage`` implements it. All places are in the world's
frame: m, rad; floor 0 is the lowest. Unknown names raise NotFound, and impossible requests raise ValueError in plain
words.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.geometry import Point, Pose, Vector3
from roboglot.model.perception import Emotion, Gesture, Sport, TagKind
from roboglot.model.sound import Sound
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Placed:
    """Name and pose of something in the world."""

    name: str
    pose: Pose
    floor: int


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A box that was added to the world; ``size``: x, y, z extent in m; ``number`` removes it."""

    number: int
    pose: Pose
    size: tuple[float, float, float]
    floor: int


@dataclass(frozen=True, slots=True)
class HungTag:
    """A printed code that was hung up: ``pose`` with +x out of it, ``height`` of its middle, m."""

    number: int
    kind: TagKind
    text: str
    pose: Pose
    floor: int
    height: float
    size: float


@dataclass(frozen=True, slots=True)
class ActiveFault:
    """An active fault; ``robot`` is None for faults of the building. ``number`` clears it."""

    number: int
    kind: str
    robot: str | None
    options: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class FaultKind:
    """A fault that can be injected; ``options`` by name with their defaults (None: the simulation chooses)."""

    name: str
    of_robot: bool
    options: Mapping[str, float | int | str | None]


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """Plan of a floor: ``walls`` and ``furniture`` as closed polygons in the world's frame, m."""

    number: int
    name: str
    walls: Sequence[Sequence[Point]]
    furniture: Sequence[Sequence[Point]]


class StagePerson(ABC):
    """A person who can be directed: carries out calls one after the other, then stands."""

    @property
    @abstractmethod
    def pose(self) -> Pose:
        """Current pose of the person."""

    @property
    @abstractmethod
    def floor(self) -> int:
        """Floor of the person."""

    @abstractmethod
    def walk_to(self, x: float, y: float, *, speed: float | None = None) -> None:
        """Walk to a place (m) in a straight line, through obstacles, at ``speed`` (m/s)."""

    @abstractmethod
    def look_at(self, x: float, y: float) -> None:
        """Turn to face a place."""

    @abstractmethod
    def gesture(self, gesture: Gesture, seconds: float = 3.0) -> None:
        """Make a gesture for ``seconds``."""

    @abstractmethod
    def say(self, text: str) -> None:
        """Say a text aloud."""

    @abstractmethod
    def clap(self, count: int = 2) -> None:
        """Clap ``count`` times."""

    @abstractmethod
    def do_sport(self, sport: Sport, count: int = 10, period: float = 2.0) -> None:
        """Do ``count`` repetitions of ``period`` s; a plank is held for count times period."""

    @abstractmethod
    def feel(self, emotion: Emotion) -> None:
        """Show an emotion from then on."""

    @abstractmethod
    def wait(self, seconds: float) -> None:
        """Stand for so long before the next call."""

    @abstractmethod
    def stand(self) -> None:
        """Drop all calls and the script of the world's file, and stand."""

    @abstractmethod
    def resume(self) -> None:
        """Return to the script of the world's file."""

    @abstractmethod
    def place(self, x: float, y: float, facing: float = 0.0) -> None:
        """Move to a place at once, look to ``facing`` degrees, and stand. Raises Refused if a robot is there."""


class Stage(ABC):
    """Control of one world, for tests, consoles and agents."""

    @property
    @abstractmethod
    def seed(self) -> int:
        """Seed of all random numbers of the world: noise, outages, places of kidnapped robots."""

    @abstractmethod
    def reseed(self, seed: int) -> None:
        """Restart random numbers from ``seed``; bodies keep the errors (scale, bias) they were built with."""

    # -- what is there --

    @property
    @abstractmethod
    def robots(self) -> Sequence[Placed]:
        """All robots at their true poses."""

    @property
    @abstractmethod
    def people(self) -> Sequence[Placed]:
        """All people, by the names that ``person`` takes."""

    @property
    @abstractmethod
    def things(self) -> Sequence[Placed]:
        """Small things that can be pushed, gripped and carried."""

    @property
    @abstractmethod
    def obstacles(self) -> Sequence[Obstacle]:
        """Boxes that were added to the world."""

    @property
    @abstractmethod
    def tags(self) -> Sequence[HungTag]:
        """Printed codes that were added to the world."""

    @property
    @abstractmethod
    def floors(self) -> Sequence[FloorPlan]:
        """Floors of the building as described, the lowest first."""

    @abstractmethod
    def world_file(self) -> str:
        """Return the current world as a world file (TOML), with boxes, people and things where they are."""

    # -- robots --

    @abstractmethod
    def place(self, name: str, pose: Pose, floor: int | None = None) -> None:
        """Lift a robot and put it elsewhere; its odometry does not notice.

        Raises ValueError off the floors, Refused where something stands or the floor has a gap.
        """

    @abstractmethod
    def reset(self, name: str) -> None:
        """Put a robot back where it started, charged as then, on its legs, without its faults and emergency stop.

        It keeps what it knows: like a robot that was carried, it has to find itself on its map. Raises Refused if
        something is in the way.
        """

    @abstractmethod
    def refuse_reset(self, name: str) -> None:
        """Raise Refused if something is in the way of ``reset``, for a caller that would first stop the robot."""

    @abstractmethod
    def lift(self, name: str, height: float = 0.3) -> None:
        """Lift a robot by ``height`` m, and hold it there until ``let_go``. Raises ValueError beyond 10 m."""

    @abstractmethod
    def let_go(self, name: str) -> None:
        """Let go of a lifted robot, which falls."""

    @abstractmethod
    def push(self, name: str, impulse: Vector3) -> None:
        """Push a robot with an impulse (N s, base_link). Raises ValueError beyond 500 N s along an axis."""

    @abstractmethod
    def pull(self, name: str, force: Point) -> None:
        """Pull a robot's leash with a force (N, world) from now on; 0 lets it hang.

        A robot that walks on a leash gives way; any other stands against it. Raises ValueError beyond 1000 N along an
        axis.
        """

    @abstractmethod
    def roll_over(self, name: str, roll: float = math.pi) -> None:
        """Roll a robot over by ``roll`` (rad about its x); 0: back onto its wheels.

        Raises ValueError beyond a whole turn.
        """

    @abstractmethod
    def touch(self, name: str, kind: TouchKind = TouchKind.SINGLE) -> None:
        """Touch a robot's pad. Raises ComponentMissing."""

    @abstractmethod
    def plug_in(self, name: str, wire: bool = True) -> None:
        """Plug a charger into a robot, or unplug it. Raises ComponentMissing."""

    @abstractmethod
    def touch_plate(self, name: str, place: PlatePlace) -> None:
        """Tap an armor plate. Raises NotFound if the robot has none there."""

    @abstractmethod
    def apply_voltage(self, name: str, adapter: int, port: int, voltage: float) -> None:
        """Set the voltage (V) of a sensor adapter's input. Raises NotFound, InvalidGoal beyond the full scale."""

    # -- people, things, sounds --

    @abstractmethod
    def person(self, name: str) -> StagePerson:
        """Return a person to direct, by name, or by place in the file ("person 0 2": the third on the lowest floor)."""

    @abstractmethod
    def add_person(self, pose: Pose, floor: int = 0, name: str = "") -> str:
        """Add a person; return their name.

        Raises ValueError for a taken name or too many people, Refused in a robot.
        """

    @abstractmethod
    def remove_person(self, name: str) -> None:
        """Remove a person. Raises NotFound; ValueError if the person wears a gadget."""

    @abstractmethod
    def move_thing(self, name: str, position: Vector3) -> None:
        """Move a small thing to a position (m), at rest. Raises NotFound, ValueError beyond 10 km."""

    @abstractmethod
    def add_obstacle(self, pose: Pose, size: tuple[float, float, float] = (0.4, 0.4, 1.0), floor: int = 0) -> int:
        """Add a box (x, y, z extent in m); return its number. Raises Refused if a robot is there."""

    @abstractmethod
    def remove_obstacle(self, number: int) -> None:
        """Remove a box that was added."""

    @abstractmethod
    def move_obstacle(self, number: int, pose: Pose, floor: int) -> None:
        """Move a box that was added. Raises Refused if a robot is there."""

    @abstractmethod
    def add_tag(
        self,
        text: str,
        pose: Pose,
        floor: int = 0,
        *,
        kind: TagKind = TagKind.APRIL,
        height: float = 0.4,
        size: float = 0.16,
    ) -> int:
        """Hang up an AprilTag (``text``: its number) or a QR code, +x of ``pose`` out of it; return its number here.

        Raises ValueError for what no such code can say, and for too many.
        """

    @abstractmethod
    def move_tag(self, number: int, pose: Pose, floor: int) -> None:
        """Move a code that was added."""

    @abstractmethod
    def remove_tag(self, number: int) -> None:
        """Remove a code that was added."""

    @abstractmethod
    def make_sound(self, sound: Sound, at: Point, floor: int = 0, loudness: float = 1.0) -> None:
        """Play ``sound`` at a place, from now on. Raises ValueError if too many are playing, or too loud (over 100)."""

    # -- faults --

    @property
    @abstractmethod
    def fault_kinds(self) -> Sequence[FaultKind]:
        """All kinds of faults that ``inject_fault`` takes, by name."""

    @property
    @abstractmethod
    def faults(self) -> Sequence[ActiveFault]:
        """Active faults, oldest first."""

    @abstractmethod
    def inject_fault(
        self, kind: str, robot: str | None = None, *, duration: float | None = None, **options: object
    ) -> Sequence[ActiveFault]:
        """Inject a fault: into one robot, into all that have the part (None), or into the building.

        It ends after ``duration`` s of robot time, or with ``clear_fault``.
        """

    @abstractmethod
    def clear_fault(self, number: int | None = None) -> None:
        """End one fault, or all. Effects that cannot be undone (a robot that was carried off) stay. Raises NotFound."""
