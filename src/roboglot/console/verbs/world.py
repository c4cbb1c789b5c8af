"""Verbs that change a simulated world: where robots, people and boxes are, faults. In the world's frame, m, rad."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec

from roboglot.console.verbs.robots import Meters, Name, Radians, Text, visible
from roboglot.model.geometry import Point, Pose, Vector3
from roboglot.model.perception import TagKind
from roboglot.model.sound import claps, tone
from roboglot.model.stage import Stage
from roboglot.operations import OperationTable, Right

Floor = Annotated[int, msgspec.Meta(ge=0, le=200)]
PersonName = Annotated[str, msgspec.Meta(max_length=50)]
TagText = Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
Extent = Annotated[float, msgspec.Meta(gt=0.01, le=20)]
Seed = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]
Newtons = Annotated[float, msgspec.Meta(ge=-500, le=500)]  # N s

WORLD_VERBS: OperationTable[str] = OperationTable("console world", Right.ADMIN, exact=True)


@WORLD_VERBS.on("reseed")
async def reseed(stage: Stage, *, seed: Seed) -> None:
    """Restart noise and outages from another seed; bodies keep the errors they were built with."""
    stage.reseed(seed)


@WORLD_VERBS.on("place_robot")
async def place_robot(
    stage: Stage, *, robot: Name, x: Meters, y: Meters, yaw: Radians = 0.0, floor: Floor | None = None
) -> None:
    """Carry a robot elsewhere; its odometry does not notice."""
    stage.place(robot, Pose(x, y, yaw), floor)


@WORLD_VERBS.on("push")
async def push(stage: Stage, *, robot: Name, x: Newtons = 0.0, y: Newtons = 0.0) -> None:
    """Give a robot a blow, N s along its own axes."""
    stage.push(robot, Vector3(x, y))


@WORLD_VERBS.on("lift")
async def lift(stage: Stage, *, robot: Name, up: bool) -> None:
    """Take a robot off the floor, or let it go."""
    if up:
        stage.lift(robot)
    else:
        stage.let_go(robot)


@WORLD_VERBS.on("plug_in")
async def plug_in(stage: Stage, *, robot: Name, wire: bool) -> None:
    """Put the charger's plug into a robot, or pull it out."""
    stage.plug_in(robot, wire)


@WORLD_VERBS.on("add_box")
async def add_box(
    stage: Stage,
    *,
    x: Meters,
    y: Meters,
    yaw: Radians = 0.0,
    width: Extent = 0.4,
    depth: Extent = 0.4,
    height: Extent = 1.0,
    floor: Floor = 0,
) -> int:
    """Put a box into the world; the answer is its number."""
    return stage.add_obstacle(Pose(x, y, yaw), (width, depth, height), floor)


@WORLD_VERBS.on("remove_box")
async def remove_box(stage: Stage, *, number: int) -> None:
    """Take a box away."""
    stage.remove_obstacle(number)


@WORLD_VERBS.on("move_box")
async def move_box(
    stage: Stage, *, number: int, x: Meters, y: Meters, yaw: Radians | None = None, floor: Floor = 0
) -> None:
    """Put a box elsewhere; without ``yaw`` it stays turned as it is."""
    box = next((each for each in stage.obstacles if each.number == number), None)
    stage.move_obstacle(number, Pose(x, y, yaw if yaw is not None else box.pose.yaw if box else 0.0), floor)


@WORLD_VERBS.on("add_tag")
async def add_tag(
    stage: Stage,
    *,
    text: TagText,
    x: Meters,
    y: Meters,
    yaw: Radians = 0.0,
    kind: TagKind = TagKind.APRIL,
    height: Extent = 0.4,
    floor: Floor = 0,
) -> int:
    """Hang an AprilTag (its number) or a QR code there, facing ``yaw``; the answer is the number that removes it."""
    return stage.add_tag(text, Pose(x, y, yaw), floor, kind=kind, height=height)


@WORLD_VERBS.on("move_tag")
async def move_tag(
    stage: Stage, *, number: int, x: Meters, y: Meters, yaw: Radians | None = None, floor: Floor = 0
) -> None:
    """Hang a code elsewhere; without ``yaw`` it faces where it did."""
    tag = next((each for each in stage.tags if each.number == number), None)
    stage.move_tag(number, Pose(x, y, yaw if yaw is not None else tag.pose.yaw if tag else 0.0), floor)


@WORLD_VERBS.on("remove_tag")
async def remove_tag(stage: Stage, *, number: int) -> None:
    """Take a code down."""
    stage.remove_tag(number)


@WORLD_VERBS.on("make_sound")
async def make_sound(
    stage: Stage,
    *,
    x: Meters,
    y: Meters,
    sound: Literal["claps", "tone"] = "claps",
    frequency: Annotated[float, msgspec.Meta(ge=20, le=20_000)] = 1000.0,
    seconds: Annotated[float, msgspec.Meta(gt=0, le=30)] = 2.0,
    floor: Floor = 0,
) -> None:
    """Have two claps, or a tone of ``frequency`` Hz for ``seconds``, be heard from there."""
    stage.make_sound(claps() if sound == "claps" else tone(frequency, seconds), Point(x, y), floor)


@WORLD_VERBS.on("add_person")
async def add_person(
    stage: Stage, *, x: Meters, y: Meters, yaw: Radians = 0.0, floor: Floor = 0, name: PersonName = ""
) -> str:
    """Put one more person there; the answer is their name."""
    return stage.add_person(Pose(x, y, yaw), floor, visible(name) if name else "")


@WORLD_VERBS.on("remove_person")
async def remove_person(stage: Stage, *, person: Name) -> None:
    """Take a person out of the world."""
    stage.remove_person(person)


@WORLD_VERBS.on("move_person")
async def move_person(stage: Stage, *, person: Name, x: Meters, y: Meters) -> None:
    """Have a person drop everything and walk there in a straight line."""
    actor = stage.person(person)
    actor.stand()
    actor.walk_to(x, y)


@WORLD_VERBS.on("place_person")
async def place_person(stage: Stage, *, person: Name, x: Meters, y: Meters, degrees: float = 0.0) -> None:
    """Have a person stand there at once."""
    stage.person(person).place(x, y, degrees)


@WORLD_VERBS.on("resume_person")
async def resume_person(stage: Stage, *, person: Name) -> None:
    """Have a person go back to what the world's file says."""
    stage.person(person).resume()


@WORLD_VERBS.on("person_says")
async def person_says(stage: Stage, *, person: Name, text: Text) -> None:
    """Have a person say something aloud."""
    stage.person(person).say(text)


@WORLD_VERBS.on("move_thing")
async def move_thing(stage: Stage, *, thing: Name, x: Meters, y: Meters, z: Meters = 0.05) -> None:
    """Put a small thing elsewhere."""
    if thing not in {placed.name for placed in stage.things}:
        raise ValueError(f"no thing here is named {thing!r}")
    stage.move_thing(thing, Vector3(x, y, z))


@WORLD_VERBS.on("inject_fault")
async def inject_fault(
    stage: Stage,
    *,
    kind: Name,
    robot: Name | None = None,
    duration: Annotated[float, msgspec.Meta(gt=0, le=86_400)] | None = None,
    options: dict[str, Any] | None = None,
) -> list[int]:
    """Break something; the answer is the faults' numbers."""
    return [fault.number for fault in stage.inject_fault(kind, robot, duration=duration, **options or {})]


@WORLD_VERBS.on("clear_fault")
async def clear_fault(stage: Stage, *, number: int | None = None) -> None:
    """Mend one fault, or all."""
    stage.clear_fault(number)
