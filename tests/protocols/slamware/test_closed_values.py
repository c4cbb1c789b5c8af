"""Values that the manual lists: each request takes those and refuses all others, in every operation and action."""

from __future__ import annotations

import enum
import inspect
import types
import typing
from collections.abc import Iterator
from typing import Any

import httpx
import msgspec
import pytest

from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.actions import FACTORIES
from roboglot.protocols.slamware.dispatch import TABLE

ACTIONS, ADMIN = "/api/core/motion/v1/actions", "/api/delivery/v1/admin"
# Fields for which the manual lists values, by name; a field of these names is never free text or any number.
LISTED = {
    "mode", "flags", "param", "networkmode", "channel", "controlPart", "direction", "tag_type", "backup_mode", "op",
    "elevator_door_flag", "elevator_stopping_yaw", "recover_movement_type", "work_mode", "usage", "type", "status",
}  # fmt: skip
Place = tuple[str, ...]  # fields, from the outside; "[]" is an item of a list


def requests() -> Iterator[tuple[str, Any]]:
    """All that a client sends: parameters of operations, options of actions."""
    for name, factory in FACTORIES.items():
        yield name, factory.options
    for key in sorted(TABLE.implemented()):
        for name, parameter in [*inspect.signature(TABLE[key].handler, eval_str=True).parameters.items()][1:]:
            yield f"{key} {name}", parameter.annotation


def fields(of: type[msgspec.Struct]) -> dict[str, tuple[Any, bool]]:
    hints = typing.get_type_hints(of, include_extras=True)
    return {field.encode_name: (hints[field.name], field.required) for field in msgspec.structs.fields(of)}


def leaves(kind: Any, place: Place = ()) -> Iterator[tuple[Place, Any]]:
    """All places below a type that hold no structure, with their types."""
    match typing.get_origin(kind):
        case typing.Union | types.UnionType:
            for each in typing.get_args(kind):
                yield from leaves(each, place)
        case origin if origin is list:
            yield from leaves(typing.get_args(kind)[0], (*place, "[]"))
        case None if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
            for name, (inner, _) in fields(kind).items():
                yield from leaves(inner, (*place, name))
        case _:
            yield place, kind


def bounds(kind: Any) -> bool:
    """Return whether a type has a list of values: an enumeration, literals, or a range of few integers."""
    if isinstance(kind, type):
        return issubclass(kind, enum.Enum | bool | types.NoneType)
    if typing.get_origin(kind) is typing.Annotated:
        inner, meta = typing.get_args(kind)
        return bounds(inner) or (
            inner is int and meta.ge is not None and meta.le is not None and meta.le - meta.ge < 10
        )
    return typing.get_origin(kind) is typing.Literal


def test_listed_values_have_closed_types() -> None:
    checked = set()
    for request, kind in requests():
        for place, leaf in leaves(kind):
            name = next((part for part in reversed(place) if part != "[]"), request.rpartition(" ")[2])
            if name in LISTED:
                assert bounds(leaf), (request, place, leaf)
                checked.add(name)
    assert checked == LISTED


MOVES = [
    name for name, factory in FACTORIES.items() if any("move_options" in place for place, _ in leaves(factory.options))
]
GOAL = {"x": 1.0, "y": 1.0, "z": 0.0, "yaw": 0.0, "pitch": 0.0, "roll": 0.0, "poi_name": ""}
OPTIONS = {"target": GOAL, "targets": [GOAL], "path_points": [GOAL], "elevator_id": "a"}


def options_of(name: str, how: dict[str, Any]) -> dict[str, Any]:
    """Return valid options of an action with these move options, wherever it has them."""
    place = next(place for place, _ in leaves(FACTORIES[name].options) if "move_options" in place)
    inner: dict[str, Any] = {"move_options": how}
    for part in reversed(place[: place.index("move_options")]):
        inner = {part: inner}
    return {**{key: value for key, value in OPTIONS.items() if key in fields(FACTORIES[name].options)}, **inner}


@pytest.mark.parametrize("name", MOVES)
def test_move_options_are_known_or_refused(name: str) -> None:
    kind = FACTORIES[name].options
    flags = ["precise", "with_yaw", "fail_retry_count", "find_path_ignoring_dynamic_obstacles"]
    for right in (
        {"flags": flags},
        {"flags": ["with_directed_virtual_track"]},
        {"flags": [None]},
        {"flags": 0},
        {"mode": 2},
    ):
        msgspec.convert(options_of(name, right), kind)
    for wrong in (
        {"flags": ["teleport"]},
        {"flags": ["precise", ""]},
        {"flags": 16},
        {"flags": "precise"},
        {"mode": 3},
    ):
        with pytest.raises(msgspec.ValidationError, match=next(iter(wrong))):
            msgspec.convert(options_of(name, wrong), kind)


@pytest.mark.world("empty")
def optional_bodies() -> Iterator[str]:
    """Operations whose bodies need no field."""
    for key in sorted(TABLE.implemented()):
        body = inspect.signature(TABLE[key].handler, eval_str=True).parameters.get("body")
        for kind in typing.get_args(body.annotation) or (body.annotation,) if body else ():
            if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
                known = fields(kind).values()
                if known and not any(required for _, required in known):
                    yield key


async def test_misspelt_bodies_change_nothing(robot: Robot, client: httpx.AsyncClient) -> None:
    """A misspelt delay shut the robot down at once, and misspelt hours cleared those set."""
    hours = {"hours": [{"start_time": "08:00:00", "end_time": "18:00:00"}], "restdays": [0]}
    assert (await client.put(f"{ADMIN}/working_time", json=hours)).status_code == 200
    tried = list(optional_bodies())
    assert len(tried) >= 10
    for key in tried:
        method, path = key.split(" ")
        path = path.format(poi_id="x", usage="restricted_area", id=1, dock_id="d")
        reply = await client.request(method, path, json={"hour": 1})
        assert (reply.status_code, "hour is unknown; " in reply.text) == (400, True), (key, reply.text)
    assert (await client.get(f"{ADMIN}/working_time")).json() == hours
    assert robot[Power].mode is PowerMode.AWAKE
    known_too = await client.put(f"{ADMIN}/line_speed", json={"delivery_speed": 0.3, "later": 1})
    assert known_too.status_code == 200  # as firmware sends more fields than the manual has


async def test_unknown_flags_are_refused_by_name(robot: Robot, client: httpx.AsyncClient) -> None:
    options = {"target": {"x": 1, "y": 0}, "move_options": {"mode": 0, "flags": ["with_yaw", "fly"]}}
    body = {"action_name": "slamtec.agent.actions.MoveToAction", "options": options}
    refused = await client.post(ACTIONS, json=body)
    assert (refused.status_code, refused.reason_phrase) == (400, "Can not create action")
    assert "move_options.flags" in refused.text
    assert not robot.actions.running()
    for wrong in ({"flags": ["fly"]}, {"mode": 7}):
        assert (await client.put(f"{ADMIN}/move_options", json=wrong)).status_code == 400
