"""A world in its present state as a world file: the building as described, all movable things at their places."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import Any

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from roboglot.simulation.people.people import Walker
from roboglot.simulation.world.description import Box, Floor, Person, Spot, Start, Tag, Thing, WorldDescription
from roboglot.simulation.world.environment import Environment
from roboglot.simulation.world.population import Population

DIGITS = 4  # of metres and degrees


def snapshot(population: Population, environment: Environment) -> WorldDescription:
    """Describe the world with boxes, people and things at their present places, and the first robot's as the start."""
    world = environment.description
    floors = [_floor_now(number, floor, population, environment) for number, floor in enumerate(world.floors)]
    start = world.start
    if first := next(iter(population.hulls.values()), None):
        start = Start((_rounded(first.pose.x), _rounded(first.pose.y)), _degrees(first.pose.yaw), first.floor)
    return replace(world, floors=tuple(floors), start=start)


def _floor_now(number: int, floor: Floor, population: Population, environment: Environment) -> Floor:
    boxes = [
        Box(
            at=(_rounded(solid.pose.x), _rounded(solid.pose.y)),
            size=(_rounded(solid.size[0]), _rounded(solid.size[1]), _rounded(solid.size[2])),
            facing=_degrees(solid.pose.yaw),
        )
        for level, solid in population.physics.obstacles.values()
        if level == number
    ]
    tags = [
        Tag(
            at=(_rounded(tag.card.pose.x), _rounded(tag.card.pose.y)),
            text=tag.text,
            kind=tag.kind,
            facing=_degrees(tag.card.pose.yaw),
            height=_rounded(tag.card.height),
            size=_rounded(tag.card.size),
        )
        for level, tag in population.physics.props.tags.values()
        if level == number
    ]
    here = [walker for walker in population.walkers if walker.floor == number]
    people = tuple(_person_now(walker.person, walker) for walker in here)
    where = {id(walker.person): index for index, walker in enumerate(here)}
    gadgets = tuple(
        gadget if gadget.wearer is None else replace(gadget, wearer=where[id(floor.people[gadget.wearer])])
        for gadget in floor.gadgets
    )
    things = tuple(_thing_now(thing, environment) for thing in floor.things)
    return replace(
        floor,
        furniture=(*floor.furniture, *boxes),
        tags=(*floor.tags, *tags),
        people=people,
        gadgets=gadgets,
        things=things,
        like="",
    )


def _person_now(person: Person, walker: Walker) -> Person:
    """Return a person with the script from its beginning, or standing at the present place without one."""
    if walker.follows_script:
        return replace(person, emotion=walker.emotion)
    spot: Spot = (_rounded(walker.pose.x), _rounded(walker.pose.y))
    facing = _degrees(walker.pose.yaw)
    return replace(person, path=(spot,), facing=facing, script=(), emotion=walker.emotion)


def _thing_now(thing: Thing, environment: Environment) -> Thing:
    x, y, _ = environment.things[thing.name].position
    return replace(thing, at=(_rounded(x), _rounded(y)))


def _rounded(meters: float) -> float:
    return round(float(meters), DIGITS)


def _degrees(radians: float) -> float:
    return _rounded(math.degrees(radians))


def world_toml(world: WorldDescription) -> str:
    """Return the text of a world file in the style of the shipped ones: a table per floor, a line per list entry.

    Reading it gives the same description again; fields with default values are left out.
    """
    return "\n".join(_lines(world)) + "\n"


def _lines(world: WorldDescription) -> Iterator[str]:
    values = _plain(world)
    floors = values.pop("floors")
    tables = {key: values.pop(key) for key in list(values) if isinstance(values[key], dict)}
    yield from _entries(values)
    for name, table in tables.items():
        yield from ("", f"[{name}]")
        yield from _entries(table)
    for floor in floors:
        yield from ("", "[[floors]]")
        yield from _entries(floor)


def _entries(values: Mapping[str, object]) -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            yield f"{key} = ["
            yield from (f"    {_inline(entry)}," for entry in value)
            yield "]"
        else:
            yield f"{key} = {_inline(value)}"


def _inline(value: object) -> str:
    """Return ``value`` on one line; JSON's strings, numbers and booleans are TOML's, too."""
    if isinstance(value, dict):
        inner = ", ".join(f"{_key(key)} = {_inline(entry)}" for key, entry in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(_inline, value))}]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(text: str) -> str:
    return text if text.replace("_", "").isalnum() and text.isascii() else json.dumps(text)


def _plain(value: Any) -> Any:
    """Return structs as dictionaries of the values that differ from their defaults, by the file's names."""
    if isinstance(value, Struct):
        config = value.__struct_config__
        found: dict[str, object] = {config.tag_field: config.tag} if config.tag_field else {}
        for field in msgspec.structs.fields(value):
            held = getattr(value, field.name)
            if held != _default(field):
                found[field.encode_name] = _plain(held)
        return found
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(entry) for entry in value]
    return value


def _default(field: msgspec.structs.FieldInfo) -> object:
    if field.default_factory is not msgspec.NODEFAULT:
        return field.default_factory()
    return field.default
