"""Checks of a world's description beyond its types: references, places inside floors, sizes that fit together."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence

import msgspec

from roboglot.model.components.system.network import PASSWORD_MIN
from roboglot.model.perception import TagKind
from roboglot.simulation.building.keeping import WORLDS_MAX, kept
from roboglot.simulation.building.printed_codes import QR_BYTES_MAX
from roboglot.simulation.faults.faults import problem_of
from roboglot.simulation.people.routine import Walk
from roboglot.simulation.world.declarations import BadFile
from roboglot.simulation.world.description import (
    APRIL_MAX,
    FLOORS_MAX,
    GADGETS_MAX,
    PEOPLE_MAX,
    THINGS_MAX,
    Floor,
    Spot,
    WorldDescription,
)

EDGE = 0.5  # m by which objects may protrude from a floor


@kept(WORLDS_MAX)
def completed(world: WorldDescription, where: str) -> WorldDescription:
    """Return ``world`` with every ``like`` of its floors resolved. Raises BadFile, prefixed with ``where``."""
    floors: list[Floor] = []
    for number, floor in enumerate(world.floors):
        if floor.like:
            models = [other for other in floors if other.name == floor.like]
            if not models:
                names = ", ".join(repr(other.name) for other in floors) or "none"
                raise BadFile(
                    f"{where}: floors[{number}].like = {floor.like!r} is not an earlier floor; there are: {names}"
                )
            walls, furniture = models[0].walls + floor.walls, models[0].furniture + floor.furniture
            floor = msgspec.structs.replace(floor, walls=walls, furniture=furniture)
        floors.append(floor)
    whole = msgspec.structs.replace(world, floors=tuple(floors))
    for problem in _problems(whole):
        raise BadFile(f"{where}: {problem}")
    return whole


def _problems(world: WorldDescription) -> Iterator[str]:
    """Yield problems in plain words; callers take the first."""
    yield from _count_problems(world)
    yield from _name_problems(world)
    for number, floor in enumerate(world.floors):
        yield from _floor_problems(floor, f"floors[{number}]")
    if world.start and world.start.floor >= len(world.floors):
        yield f"start.floor = {world.start.floor}, but the highest floor is {len(world.floors) - 1}"
    if world.start and world.floors and not _inside(world.start.at, world.floors[world.start.floor]):
        yield f"start.at = {list(world.start.at)} lies outside the floor"
    for i, fault in enumerate(world.faults):
        if problem := problem_of(fault):
            yield f"faults[{i}]: {problem}"
    yield from _lift_problems(world)


def _things(world: WorldDescription) -> list[str]:
    return [thing.name for floor in world.floors for thing in floor.things]


def _addresses(world: WorldDescription) -> list[str]:
    return [gadget.address for floor in world.floors for gadget in floor.gadgets]


def _count_problems(world: WorldDescription) -> Iterator[str]:
    if not 1 <= len(world.floors) <= FLOORS_MAX:
        yield f"a world has 1 to {FLOORS_MAX} floors, not {len(world.floors)}"
    if sum(len(floor.people) for floor in world.floors) > PEOPLE_MAX:
        yield f"more than {PEOPLE_MAX} people"
    if len(_things(world)) > THINGS_MAX:
        yield f"more than {THINGS_MAX} things"
    if len(_addresses(world)) > GADGETS_MAX:
        yield f"more than {GADGETS_MAX} gadgets"


def _name_problems(world: WorldDescription) -> Iterator[str]:
    if name := repeated(_things(world)):
        yield f"two things have the name {name}"
    if address := repeated(_addresses(world)):
        yield f"two gadgets have the address {address}"
    if name := repeated([person.name for floor in world.floors for person in floor.people if person.name]):
        yield f"two people have the name {name}"


def repeated(names: Sequence[str]) -> str:
    """Return the first name that occurs twice; empty if there is none."""
    return next((name for name, count in Counter(names).items() if count > 1), "")


def _lift_problems(world: WorldDescription) -> Iterator[str]:
    if lift := world.lift:
        if lift.parked_at >= len(world.floors):
            yield f"lift.parked_at = {lift.parked_at}, but the highest floor is {len(world.floors) - 1}"
        if lift.facing % 90:
            yield f"lift.facing = {lift.facing}; a lift looks to 0, 90, 180 or 270 degrees"
        if lift.door_width > lift.size[1]:
            yield f"lift.door_width = {lift.door_width} is wider than the car ({lift.size[1]})"
        if not all(_inside(lift.at, floor) for floor in world.floors):
            yield f"lift.at = {list(lift.at)} lies outside a floor"


def _floor_problems(floor: Floor, where: str) -> Iterator[str]:
    for problems in (
        _wall_problems,
        _place_problems,
        _radio_problems,
        _tag_problems,
        _ground_problems,
        _shelf_problems,
        _people_problems,
    ):
        yield from problems(floor, where)


def _wall_problems(floor: Floor, where: str) -> Iterator[str]:
    for i, wall in enumerate(floor.walls):
        if wall.length < 0.01:
            yield f"{where}.walls[{i}] has no length"
        for j, door in enumerate(wall.doors):
            if door.at - door.width / 2 < 0 or door.at + door.width / 2 > wall.length:
                yield (
                    f"{where}.walls[{i}].doors[{j}] (at {door.at}, {door.width} wide) "
                    f"does not fit into the wall, which is {wall.length:g} m long"
                )


def _place_problems(floor: Floor, where: str) -> Iterator[str]:
    for kind, things in (
        ("furniture", floor.furniture),
        ("docks", floor.docks),
        ("shelves", floor.shelves),
        ("holes", floor.holes),
        ("access_points", floor.access_points),
        ("gadgets", floor.gadgets),
        ("markers", floor.markers),
        ("tags", floor.tags),
        ("reflectors", floor.reflectors),
        ("terrain", floor.terrain),
        ("stairs", floor.stairs),
        ("things", floor.things),
    ):
        for i, thing in enumerate(things):
            if not _inside(thing.at, floor):
                yield f"{where}.{kind}[{i}].at = {list(thing.at)} lies outside the floor ({_extent(floor)})"
    for i, line in enumerate(floor.lines):
        if any(not _inside(spot, floor) for spot in line.points):
            yield f"{where}.lines[{i}] leads outside the floor ({_extent(floor)})"


def _radio_problems(floor: Floor, where: str) -> Iterator[str]:
    for i, point in enumerate(floor.access_points):
        if point.password and len(point.password) < PASSWORD_MIN:
            yield f"{where}.access_points[{i}].password is shorter than {PASSWORD_MIN} characters"
    for i, gadget in enumerate(floor.gadgets):
        if gadget.wearer is not None and gadget.wearer >= len(floor.people):
            yield f"{where}.gadgets[{i}].wearer = {gadget.wearer}, but the floor has {len(floor.people)} people"


def tag_problem(kind: TagKind, text: str) -> str:
    """Return why a code of this kind cannot hold ``text``; empty if it can."""
    if kind is TagKind.APRIL and not (text.isdecimal() and text.isascii() and int(text) <= APRIL_MAX):
        return f"an AprilTag has a number from 0 to {APRIL_MAX}"
    if kind is TagKind.QR and not 0 < len(text.encode()) <= QR_BYTES_MAX:
        return f"a QR code holds 1 to {QR_BYTES_MAX} bytes here"
    return ""


def _tag_problems(floor: Floor, where: str) -> Iterator[str]:
    for i, tag in enumerate(floor.tags):
        if problem := tag_problem(tag.kind, tag.text):
            yield f"{where}.tags[{i}].text = {tag.text!r}, but {problem}"


def _ground_problems(floor: Floor, where: str) -> Iterator[str]:
    for i, terrain in enumerate(floor.terrain):
        if any(b[0] - a[0] < 0.01 for a, b in zip(terrain.profile, terrain.profile[1:], strict=False)):
            yield f"{where}.terrain[{i}].profile must go on by at least 0.01 m from point to point"
    for i, flight in enumerate(floor.stairs):
        yaw = math.radians(flight.facing)
        end = flight.at[0] + flight.length * math.cos(yaw), flight.at[1] + flight.length * math.sin(yaw)
        if not _inside(end, floor):
            yield f"{where}.stairs[{i}] is {flight.length:g} m long and leads outside the floor ({_extent(floor)})"


def _shelf_problems(floor: Floor, where: str) -> Iterator[str]:
    for i, shelf in enumerate(floor.shelves):
        if shelf.height <= shelf.clearance:
            yield f"{where}.shelves[{i}].height = {shelf.height} is not above its clearance, {shelf.clearance}"


def _people_problems(floor: Floor, where: str) -> Iterator[str]:
    for i, person in enumerate(floor.people):
        if not person.path:
            yield f"{where}.people[{i}].path is empty; one point is a person who stands still"
        if any(math.dist(a, b) < 0.01 for a, b in zip(person.path, person.path[1:], strict=False)):
            yield f"{where}.people[{i}].path has the same point twice in a row"
        for spot in (*person.path, *(step.to for step in person.script if isinstance(step, Walk))):
            if not _inside(spot, floor):
                yield f"{where}.people[{i}].path: {list(spot)} lies outside the floor ({_extent(floor)})"


def _inside(spot: Spot, floor: Floor) -> bool:
    return all(
        origin - EDGE <= value <= origin + size + EDGE
        for value, origin, size in zip(spot, floor.origin, floor.size, strict=True)
    )


def _extent(floor: Floor) -> str:
    (x, y), (width, depth) = floor.origin, floor.size
    return f"x {x:g} to {x + width:g}, y {y:g} to {y + depth:g}"
