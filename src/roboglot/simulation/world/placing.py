"""Start places of robots: as configured, at the world's start, on docks (facing away), or beside the first one.

"Beside" means side by side in the same room with space ahead, so that each can drive off. More robots than TOGETHER
are spread over the floor's rooms, the emptiest first, away from doors and people. Where rooms are full, robots get
no space around them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import field
from itertools import pairwise, product

from roboglot.model.geometry import Pose, wrap_angle
from roboglot.simulation.building.blueprint import Solid, SolidKind, holes_of, shaft_of, solids_of
from roboglot.simulation.building.rooms import Rooms, rooms_of
from roboglot.simulation.world.description import Spot, WorldDescription
from roboglot.values import dataclass

CONTACT_GAP = 0.005  # m between hull and dock at start
BESIDE = 0.3  # m between robots that start side by side
SEARCH = 40.0  # m around the first robot
SAME_ROOM = 5.0  # m around the first robot that are searched for a good place
TOGETHER = 6  # robots that start side by side
DOOR = 0.9  # m around a door's middle that a spread robot leaves free
ROOM = 0.29, 0.15  # m around a spread robot, while such places exist
TURNS = (0.0, math.pi, math.pi / 2, -math.pi / 2)  # from the first robot's yaw, while there is room
CLEAR = 0.3, 0.05  # m around a robot in a crowd, while such places exist
AHEAD = 0.6  # m that must be free in front of a good place
NEAR, NEAR_STEP = 3.0, 0.1  # m around an occupied place that are searched for an alternative to suggest, and the step
IN_THE_WAY = {kind: f"a {kind}" for kind in SolidKind} | {SolidKind.FURNITURE: "furniture"}
GAP, EDGE, ROBOT = "a gap in the floor", "the edge of the floor", "another robot"


def docks_of(world: WorldDescription) -> list[list[Pose]]:
    """Return the docks' fronts by floor (world), +x away from the dock."""
    return [[dock.pose for dock in floor.docks] for floor in world.floors]


@dataclass(frozen=True, slots=True)
class _Search:
    """Places for robots of one size around one pose: good ones, and the rest."""

    good: Iterator[tuple[Pose, int]]
    rest: Iterator[tuple[Pose, int]]


@dataclass(slots=True)
class Places:
    """Assigns start places, one after the other."""

    world: WorldDescription
    reserved: Sequence[tuple[Pose, int, float]] = ()  # for robots with a configured place; others stay away
    _taken: list[tuple[Pose, int, float]] = field(default_factory=list)  # with the robots' radii
    _crowded: set[int] = field(default_factory=set)  # floors without good places
    _solids: dict[int, tuple[Solid, ...]] = field(default_factory=dict)
    _searches: dict[tuple[int, float, Pose], _Search] = field(default_factory=dict)
    _rooms: dict[int, Rooms] = field(default_factory=dict)
    _spots: dict[tuple[int, float, int, float], Iterator[Pose]] = field(default_factory=dict)

    def next(self, wanted: Pose | None, floor: int, radius: float) -> tuple[Pose, int]:
        """Return pose and floor for one more robot. Raises ValueError if ``wanted``, or every place, is taken."""
        if not 0 <= floor < len(self.world.floors):
            raise ValueError(f"there is no floor {floor}; the world has {len(self.world.floors)}")
        if wanted is not None:
            self._check(wanted, floor, radius)
        for pose, number in [(wanted, floor)] if wanted is not None else self._candidates(floor, radius):
            if wanted is not None or not (
                self.in_the_way(pose, number, radius) or self._reserved(pose, number, radius)
            ):
                self._taken.append((pose, number, radius))
                return pose, number
        raise ValueError(f"there is no room for another robot on floor {floor}")

    def _check(self, wanted: Pose, floor: int, radius: float) -> None:
        """Raise ValueError, naming the obstacle and a place nearby, if a robot cannot start there."""
        self.check_inside(wanted, floor)
        if obstacle := self.in_the_way(wanted, floor, radius):
            free = self._near(wanted, floor, radius)
            instead = f"; it can at {free.x:z.2f},{free.y:z.2f}" if free is not None else ""
            place = f"({wanted.x:g}, {wanted.y:g}) on floor {floor}"
            raise ValueError(f"a robot cannot stand at {place}: {obstacle} is in the way{instead}")

    def _candidates(self, floor: int, radius: float) -> Iterator[tuple[Pose, int]]:
        start = self.world.start
        if start is not None and not self._taken:
            yield Pose(*start.at, math.radians(start.facing)), start.floor
        for dock in docks_of(self.world)[floor]:
            yield dock.compose(Pose(radius + CONTACT_GAP)), floor
        here = [pose for pose, number, _ in self._taken if number == floor]
        (x, y), (width, depth) = self.world.floors[floor].origin, self.world.floors[floor].size
        around = here[0] if here else Pose(x + width / 2, y + depth / 2)
        if len(here) >= TOGETHER:
            yield from self._spread(floor, radius, here)
        search = self._searches.get((floor, radius, around))
        if search is None:
            search = self._searches[floor, radius, around] = self._search(floor, radius, around)
        if floor not in self._crowded:
            for place in search.good:  # `yield from` would close it together with this generator
                yield place
            self._crowded.add(floor)
        for place in search.rest:
            yield place

    def _spread(self, floor: int, radius: float, here: Sequence[Pose]) -> Iterator[tuple[Pose, int]]:
        """Yield places in the rooms, those with the fewest robots for their size first; nothing for a single room.

        Each place is checked once: robots only become more, so a place that was refused stays refused.
        """
        if floor not in self._rooms:
            self._rooms[floor] = rooms_of(self.world.floors[floor], self.world.lift)
        rooms = self._rooms[floor]
        if len(rooms.rooms) < 2:
            return
        cells = [rooms.cell_at(pose.x, pose.y) for pose in here]
        crowds = [sum(cell in room for cell in cells) / rooms.area(n) for n, room in enumerate(rooms.rooms)]
        order = sorted(range(len(crowds)), key=lambda n: (crowds[n], n))
        for room, number in ((room, number) for room in ROOM for number in order):
            key = floor, radius, number, room
            if key not in self._spots:
                self._spots[key] = self._roomy(rooms, key, here[0].yaw)
            for pose in self._spots[key]:  # `yield from` would close it together with this generator
                yield pose, floor

    def _roomy(self, rooms: Rooms, key: tuple[int, float, int, float], yaw: float) -> Iterator[Pose]:
        """Yield places in a room clear of robots, people, solids and doors, with space ahead; most face one way."""
        floor, radius, number, room = key
        people = self.world.floors[floor].people
        for turn, (x, y) in product(TURNS, tuple(rooms.spots(number, 2 * radius + BESIDE))):
            pose = Pose(x, y, wrap_angle(yaw + turn))
            if any(math.dist((x, y), door) < DOOR + radius for door in rooms.doors):
                continue
            if any(_away(x, y, person.path) < radius + person.radius + room for person in people):
                continue
            way = (pose.compose(Pose(AHEAD * n / 3)) for n in (0, 3, 1, 2))
            if all(self.free(at, floor, radius + room) for at in way) and not self._in_front(pose, floor, radius):
                yield pose

    def _near(self, wanted: Pose, floor: int, radius: float) -> Pose | None:
        """Return the nearest free place on a grid within ``NEAR`` of a taken one; None: there is none."""
        steps = range(-round(NEAR / NEAR_STEP), round(NEAR / NEAR_STEP) + 1)
        cells = sorted((math.hypot(i, j), i, j) for i in steps for j in steps)
        x, y = round(wanted.x, 1), round(wanted.y, 1)
        places = (Pose(x + i * NEAR_STEP, y + j * NEAR_STEP, wanted.yaw) for _, i, j in cells)
        return next((place for place in places if not self.in_the_way(place, floor, radius)), None)

    def _reserved(self, pose: Pose, floor: int, radius: float) -> bool:
        return any(number == floor and pose.distance_to(other) < radius + r for other, number, r in self.reserved)

    def _search(self, floor: int, radius: float, around: Pose) -> _Search:
        """Return iterators over the places around the first robot, nearest first; the next robot continues them.

        A place refused to a robot of this size stays refused, as robots only become more.
        """
        step = 2 * radius + BESIDE
        rings = math.ceil(SEARCH / step)
        cells = [(i, j) for i in range(-rings, rings + 1) for j in range(-rings, rings + 1)]
        rows = sorted(cells, key=lambda cell: (math.hypot(2 * cell[0], cell[1]), cell))
        near = (around.compose(Pose(i * step, j * step)) for i, j in rows if math.hypot(i, j) * step <= SAME_ROOM)
        return _Search(
            good=((place, floor) for place in near if self._good(place, around, floor, radius)),
            rest=(
                (place, floor)
                for room in (*CLEAR, 0.0)
                for place in (around.compose(Pose(i * step, j * step)) for i, j in rows)
                if self.free(place, floor, radius + room)
            ),
        )

    def _good(self, place: Pose, around: Pose, floor: int, radius: float) -> bool:
        """True if a robot there and all others can drive off, without a solid between it and the first robot."""
        if not (self.free(place, floor, radius) and self.free(place.compose(Pose(AHEAD)), floor, radius)):
            return False
        if self._in_front(place, floor, radius):
            return False
        steps = max(1, math.ceil(around.distance_to(place) / radius))
        way_x, way_y = (place.x - around.x) / steps, (place.y - around.y) / steps
        between = (Pose(around.x + n * way_x, around.y + n * way_y) for n in range(steps))
        return all(_distance(at, solid) > 0.0 for at in between for solid in self._solids[floor])

    def _in_front(self, place: Pose, floor: int, radius: float) -> bool:
        """True if a robot there would block another that drives off."""
        fronts = ((other.compose(Pose(AHEAD)), r) for other, number, r in self._taken if number == floor)
        return any(place.distance_to(front) < radius + r for front, r in fronts)

    def inside(self, pose: Pose, floor: int) -> bool:
        """True if the floor exists and the place lies on it, be it occupied or not."""
        if floor not in range(len(self.world.floors)) or not math.isfinite(pose.yaw):
            return False
        (x, y), (width, depth) = self.world.floors[floor].origin, self.world.floors[floor].size
        return x <= pose.x <= x + width and y <= pose.y <= y + depth

    def check_inside(self, pose: Pose, floor: int) -> None:
        """Raise ValueError if the floor does not exist, or the place is not on it."""
        if not self.inside(pose, floor):
            raise ValueError(f"floor {floor} of this world has no place ({pose.x:g}, {pose.y:g}, {pose.yaw:g})")

    def free(self, pose: Pose, floor: int, radius: float) -> bool:
        """True if a robot of this radius (m) can stand there without touching anything but people."""
        return not self._touched(pose, floor, radius)

    def in_the_way(self, pose: Pose, floor: int, radius: float) -> str:
        """Return what keeps a robot of this radius (m) from starting there, people and gaps too; empty: nothing."""
        if touched := self._touched(pose, floor, radius):
            return touched
        if any(math.dist((pose.x, pose.y), p.path[0]) < radius + p.radius for p in self.world.floors[floor].people):
            return IN_THE_WAY[SolidKind.PERSON]
        lift = self.world.lift
        shafts = [shaft_of(lift)] if lift is not None and lift.parked_at != floor else []
        gaps = holes_of(self.world.floors[floor]) + shafts
        return GAP if any(gap.distance_to(pose.x, pose.y) == 0.0 for gap in gaps) else ""

    def _touched(self, pose: Pose, floor: int, radius: float) -> str:
        storey = self.world.floors[floor]
        if floor not in self._solids:
            self._solids[floor] = solids_of(storey, self.world.lift, lift_here=False)
        for value, low, size in zip((pose.x, pose.y), storey.origin, storey.size, strict=True):
            if not low + radius <= value <= low + size - radius:
                return IN_THE_WAY[SolidKind.WALL] if storey.enclosed else EDGE
        if any(number == floor and pose.distance_to(other) < radius + r for other, number, r in self._taken):
            return ROBOT
        return next((IN_THE_WAY[s.kind] for s in self._solids[floor] if _distance(pose, s) < radius), "")


def _away(x: float, y: float, path: Sequence[Spot]) -> float:
    """Return the distance from a place to the nearest point of a path, m."""
    nearest = math.dist((x, y), path[0])
    for (x0, y0), (x1, y1) in pairwise(path):
        along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / max(math.dist((x0, y0), (x1, y1)) ** 2, 1e-9)
        share = min(max(along, 0.0), 1.0)
        nearest = min(nearest, math.dist((x, y), (x0 + share * (x1 - x0), y0 + share * (y1 - y0))))
    return nearest


def _distance(pose: Pose, solid: Solid) -> float:
    """Return the distance from the pose to the solid's footprint, m."""
    if solid.round:
        return pose.distance_to(solid.pose) - solid.size[0] / 2
    seen = pose.relative_to(solid.pose)
    return math.hypot(max(0.0, abs(seen.x) - solid.size[0] / 2), max(0.0, abs(seen.y) - solid.size[1] / 2))
