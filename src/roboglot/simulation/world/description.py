"""World descriptions as TOML: floors with walls, furniture, docks, people, access points, and a lift.

Metres; degrees, as people write these files: elsewhere all angles are in radians. Knows no physics:
``blueprint`` turns it into solids, ``scene`` into a MuJoCo model.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from roboglot.model.geometry import Pose
from roboglot.model.perception import Emotion, TagKind
from roboglot.simulation.people.routine import STEPS_MAX, Step

FLOORS_MAX = 20
SOLIDS_MAX = 4000
PEOPLE_MAX = 50
FAULTS_MAX = 200
THINGS_MAX = 100
APRIL_MAX = 586  # the last tag of family 36h11
GADGETS_MAX = 100
STAIR_STEPS_MAX = 30

Positive = Annotated[float, Meta(gt=0, le=1000)]
NotNegative = Annotated[float, Meta(ge=0, le=1000)]
Coordinate = Annotated[float, Meta(ge=-10_000, le=10_000)]
Degrees = Annotated[float, Meta(ge=-3600, le=3600)]
Spot = tuple[Coordinate, Coordinate]
TagNumber = Annotated[int, Meta(ge=0, le=APRIL_MAX)]
Material = Literal["plain", "glass", "mirror"]
Colour = Literal["red", "green", "blue", "yellow", "black", "white"]


class Opening(Struct, frozen=True, forbid_unknown_fields=True):
    """A gap in a wall that a robot can drive through: its middle lies ``at`` metres from the wall's start."""

    at: NotNegative
    width: Positive = 1.0


class Wall(Struct, frozen=True, forbid_unknown_fields=True):
    """A straight wall as high as the storey; ``material`` decides how lidars see it."""

    start: Spot = field(name="from")
    end: Spot = field(name="to")
    thickness: Positive = 0.12
    doors: tuple[Opening, ...] = ()
    material: Material = "plain"

    @property
    def length(self) -> float:
        """Length, m."""
        return math.dist(self.start, self.end)


class Box(Struct, frozen=True, forbid_unknown_fields=True, tag="box", tag_field="shape"):
    """Furniture: width along its x, depth along its y, height; ``base`` is the height of its underside."""

    at: Spot
    size: tuple[Positive, Positive, Positive]
    facing: Degrees = 0.0
    base: NotNegative = 0.0
    material: Material = "plain"


class Cylinder(Struct, frozen=True, forbid_unknown_fields=True, tag="cylinder", tag_field="shape"):
    """Furniture: a standing cylinder."""

    at: Spot
    radius: Positive
    height: Positive
    base: NotNegative = 0.0


class Dock(Struct, frozen=True, forbid_unknown_fields=True):
    """A charging dock: ``at`` is the middle of its front, ``facing`` the direction of its front, degrees.

    ``tag``: the number on an AprilTag on its front, if it has one.
    """

    at: Spot
    facing: Degrees = 0.0
    tag: TagNumber | None = None

    @property
    def pose(self) -> Pose:
        """Middle of the front, +x away from the dock (world; m, rad)."""
        return Pose(self.at[0], self.at[1], math.radians(self.facing))


class Hole(Struct, frozen=True, forbid_unknown_fields=True):
    """An opening in the floor, such as a stairwell: ``at`` its middle, ``size`` its extent along x and y."""

    at: Spot
    size: tuple[Positive, Positive]


class Shelf(Struct, frozen=True, forbid_unknown_fields=True):
    """A shelf on four legs that a jack can lift: ``size`` of its board, ``clearance`` below the board, m.

    ``tag``: the number on an AprilTag between its hind legs, facing the front, where robots drive in.
    """

    at: Spot
    facing: Degrees = 0.0
    size: tuple[Positive, Positive] = (0.9, 0.9)
    clearance: Positive = 1.0
    height: Positive = 1.6
    tag: TagNumber | None = None


class Person(Struct, frozen=True, forbid_unknown_fields=True):
    """A person who walks along ``path`` and back for ever, or stands still (one point); waits ``pause`` s at each.

    A ``script`` replaces the walk along ``path``, from its first point, and repeats. ``speed``: m/s.
    ``voice``: its pitch, Hz.
    """

    path: tuple[Spot, ...]
    speed: Annotated[float, Meta(gt=0, le=3)] = 1.0
    pause: NotNegative = 2.0
    radius: Annotated[float, Meta(gt=0.05, le=0.5)] = 0.22
    height: Annotated[float, Meta(gt=0.5, le=2.5)] = 1.72
    name: Annotated[str, Meta(max_length=50)] = ""
    facing: Degrees | None = None
    age: Annotated[float, Meta(ge=1, le=120)] = 35.0
    emotion: Emotion = Emotion.NEUTRAL
    voice: Annotated[float, Meta(ge=60, le=500)] = 150.0
    script: Annotated[tuple[Step, ...], Meta(max_length=STEPS_MAX)] = ()


PART = r"(25[0-5]|2[0-4]\d|1?\d?\d)"
Addresses = Annotated[str, Meta(pattern=rf"^{PART}\.{PART}\.{PART}$")]


class AccessPoint(Struct, frozen=True, forbid_unknown_fields=True):
    """A Wi-Fi access point; ``power`` is received at 1 m, dBm. Access points of one ``ssid`` form one network.

    ``password``: "" for an open network; ``addresses``: first three parts of the IP addresses it assigns.
    """

    at: Spot
    power: Annotated[float, Meta(ge=-60, le=0)] = -30.0
    ssid: Annotated[str, Meta(min_length=1, max_length=32)] = "roboglot"
    password: Annotated[str, Meta(max_length=63)] = "roboglot"
    addresses: Addresses = "10.6.128"
    internet: bool = True


class Mobile(Struct, frozen=True, forbid_unknown_fields=True):
    """Reception of the mobile network, dBm, and the operator's access point names (APN)."""

    signal: Annotated[float, Meta(ge=-140, le=-40)] = -85.0
    apns: tuple[Annotated[str, Meta(max_length=100)], ...] = ("cmnet", "cmhk")


class Gadget(Struct, frozen=True, forbid_unknown_fields=True):
    """Something with a Bluetooth radio: a bracelet (with a UWB tag), a dock, anything. ``wearer``: number of the person
    on its floor who carries it; ``power``: dBm received at 1 m; ``newest``: firmware version available for it.
    """

    name: Annotated[str, Meta(max_length=50)]
    address: Annotated[str, Meta(pattern="^([0-9A-F]{2}:){5}[0-9A-F]{2}$")]
    at: Spot
    kind: Literal["unknown", "bracelet", "dock"] = "unknown"
    random: bool = False
    firmware: Annotated[str, Meta(max_length=30)] = "1.0.0"
    newest: Annotated[str, Meta(max_length=30)] = ""
    battery: Annotated[float, Meta(ge=0, le=1)] = 0.8
    power: Annotated[float, Meta(ge=-90, le=0)] = -55.0
    wearer: Annotated[int, Meta(ge=0)] | None = None


class Georeference(Struct, frozen=True, forbid_unknown_fields=True):
    """Position of the world's origin: degrees north and east, m; ``north``: direction of north, degrees from +x."""

    latitude: Annotated[float, Meta(ge=-89, le=89)]
    longitude: Annotated[float, Meta(ge=-180, le=180)]
    altitude: Annotated[float, Meta(ge=-500, le=9000)] = 0.0
    north: Degrees = 90.0


class Marker(Struct, frozen=True, forbid_unknown_fields=True):
    """A visual marker: a square card. ``at``: its middle, ``height`` m above the floor; it faces ``facing`` degrees."""

    at: Spot
    symbol: Annotated[
        str, Meta(min_length=1, max_length=8, pattern="^([0-9A-Z?]{1,3}|heart|stop|left|right|forward|backward)$")
    ]
    facing: Degrees = 0.0
    height: NotNegative = 0.5
    size: Annotated[float, Meta(gt=0.02, le=2)] = 0.3
    colour: Colour = "red"


class Tag(Struct, frozen=True, forbid_unknown_fields=True):
    """A square printed code: an AprilTag (``text`` is its number) or a QR code. ``at``, ``height``: its middle."""

    at: Spot
    text: Annotated[str, Meta(min_length=1, max_length=100)]
    kind: TagKind = TagKind.APRIL
    facing: Degrees = 0.0
    height: NotNegative = 0.4
    size: Annotated[float, Meta(gt=0.02, le=2)] = 0.16


class Reflector(Struct, frozen=True, forbid_unknown_fields=True):
    """A vertical strip of reflecting foil from height ``base`` to ``top``, m."""

    at: Spot
    facing: Degrees = 0.0
    width: Annotated[float, Meta(gt=0.01, le=1)] = 0.1
    base: NotNegative = 0.1
    top: Positive = 0.7


class Line(Struct, frozen=True, forbid_unknown_fields=True):
    """A coloured tape on the floor."""

    points: Annotated[tuple[Spot, ...], Meta(min_length=2, max_length=500)]
    width: Annotated[float, Meta(gt=0.005, le=0.5)] = 0.05
    colour: Colour = "blue"


class Terrain(Struct, frozen=True, forbid_unknown_fields=True):
    """Ramps, bumps and steps: ``profile`` lists (distance, height) along its x, with straight slopes between.

    ``at``: middle of the edge at distance 0. ``grip`` is relative to the floor's: 0.1 is ice, on flat parts too.
    """

    at: Spot
    profile: Annotated[tuple[tuple[NotNegative, NotNegative], ...], Meta(min_length=2, max_length=50)]
    width: Positive = 1.0
    facing: Degrees = 0.0
    grip: Annotated[float, Meta(ge=0, le=2)] = 1.0


class Stairs(Struct, frozen=True, forbid_unknown_fields=True):
    """A straight flight of stairs, solid below, rising towards ``facing``. ``at``: middle of the first riser's foot.

    ``rise`` and ``run`` of each step, m; a ``landing`` prolongs the last step and ends in a sheer drop.
    """

    at: Spot
    steps: Annotated[int, Meta(ge=1, le=STAIR_STEPS_MAX)]
    rise: Annotated[float, Meta(ge=0.01, le=0.5)] = 0.15
    run: Annotated[float, Meta(ge=0.1, le=2)] = 0.3
    width: Positive = 1.0
    facing: Degrees = 0.0
    landing: NotNegative = 1.0

    @property
    def length(self) -> float:
        """Length from the first riser to the landing's end, m."""
        return self.steps * self.run + self.landing

    @property
    def treads(self) -> tuple[Terrain, ...]:
        """Each step as a level block, as a terrain's profile cannot be vertical like a riser."""
        yaw = math.radians(self.facing)
        blocks = []
        for number in range(self.steps):
            way = number * self.run
            at = (self.at[0] + way * math.cos(yaw), self.at[1] + way * math.sin(yaw))
            depth = self.length - way if number == self.steps - 1 else self.run
            top = (number + 1) * self.rise
            blocks.append(Terrain(at, ((0.0, top), (depth, top)), self.width, self.facing))
        return tuple(blocks)


class Thing(Struct, frozen=True, forbid_unknown_fields=True):
    """A small can that can be pushed, gripped and carried; ``mass`` in kg."""

    name: Annotated[str, Meta(min_length=1, max_length=50)]
    at: Spot
    diameter: Annotated[float, Meta(ge=0.01, le=0.5)] = 0.05
    height: Annotated[float, Meta(ge=0.01, le=0.5)] = 0.08
    mass: Annotated[float, Meta(ge=0.01, le=20)] = 0.1


class Start(Struct, frozen=True, forbid_unknown_fields=True):
    """Start of the first robot, instead of a dock."""

    at: Spot
    facing: Degrees = 0.0
    floor: Annotated[int, Meta(ge=0, lt=FLOORS_MAX)] = 0


class Lift(Struct, frozen=True, forbid_unknown_fields=True):
    """A lift shaft through all floors; ``at`` its middle, ``size`` the car's floor, ``facing`` the door's direction.

    ``speed`` and ``acceleration`` of the car (m/s, m/s2), ``door_time`` to open or close (s), ``dwell``: the least time
    that the door stays open (s), ``capacity`` in kg.
    """

    at: Spot
    size: tuple[Positive, Positive] = (1.6, 1.6)
    facing: Degrees = 0.0
    door_width: Positive = 1.0
    parked_at: Annotated[int, Meta(ge=0, lt=FLOORS_MAX)] = 0
    speed: Annotated[float, Meta(gt=0, le=10)] = 1.0
    acceleration: Annotated[float, Meta(gt=0, le=3)] = 0.6
    door_time: Annotated[float, Meta(ge=0.2, le=30)] = 2.0
    dwell: Annotated[float, Meta(ge=0, le=300)] = 4.0
    capacity: Positive = 630.0


class PlannedFault(Struct, frozen=True, forbid_unknown_fields=True):
    """A fault ``at`` seconds of robot time, for ``duration`` s, of ``robot`` (None: of all that can have it)."""

    kind: str
    at: NotNegative = 0.0
    duration: Positive | None = None
    robot: str | None = None
    options: dict[str, float | int | str] = {}


class Floor(Struct, frozen=True, cache_hash=True, forbid_unknown_fields=True):
    """One storey; ``origin``: its lower left corner. ``like``: an earlier floor to copy walls and furniture from."""

    size: tuple[Positive, Positive]
    name: str = ""
    origin: Spot = (0.0, 0.0)
    height: Positive = 3.2
    enclosed: bool = True
    like: str = ""
    walls: tuple[Wall, ...] = ()
    furniture: tuple[Box | Cylinder, ...] = ()
    docks: tuple[Dock, ...] = ()
    shelves: tuple[Shelf, ...] = ()
    holes: tuple[Hole, ...] = ()
    people: tuple[Person, ...] = ()
    access_points: tuple[AccessPoint, ...] = ()
    gadgets: tuple[Gadget, ...] = ()
    outdoors: bool = False
    markers: tuple[Marker, ...] = ()
    lines: tuple[Line, ...] = ()
    tags: tuple[Tag, ...] = ()
    reflectors: tuple[Reflector, ...] = ()
    terrain: tuple[Terrain, ...] = ()
    stairs: tuple[Stairs, ...] = ()
    things: tuple[Thing, ...] = ()

    @property
    def relief(self) -> tuple[Terrain, ...]:
        """All uneven ground: terrain, and the steps of stairs."""
        return self.terrain + tuple(tread for flight in self.stairs for tread in flight.treads)


class WorldDescription(Struct, frozen=True, cache_hash=True, forbid_unknown_fields=True):
    """A whole world; floors from the ground up."""

    floors: tuple[Floor, ...]
    name: str = ""
    lift: Lift | None = None
    faults: Annotated[tuple[PlannedFault, ...], Meta(max_length=FAULTS_MAX)] = ()
    start: Start | None = None
    georeference: Georeference | None = None
    mobile: Mobile = Mobile()

    def elevation(self, floor: int) -> float:
        """Return the height of a floor's surface, m."""
        return sum(storey.height for storey in self.floors[:floor])
