"""Ranges and units of the studio's blocks: what a block allows, its function takes."""

from __future__ import annotations

from typing import Any

import pytest

from roboglot.console.studio.blocks import table
from roboglot.model.errors import RobotError
from roboglot.programs.functions.moving.choreography import Choreography
from roboglot.programs.functions.results import refusal
from tests.programs.functions.calling import Caller

FUNCTIONS: list[dict[str, Any]] = table()["functions"]
LIMITED = [
    (function["key"], parameter["name"])
    for function in FUNCTIONS
    for parameter in function["parameters"]
    if "minimum" in parameter
]


def described(key: str, name: str) -> dict[str, Any]:
    function = next(function for function in FUNCTIONS if function["key"] == key)
    return next(parameter for parameter in function["parameters"] if parameter["name"] == name)


@pytest.mark.parametrize("end", ["minimum", "maximum"])
@pytest.mark.parametrize(("key", "name"), LIMITED, ids=[".".join(found) for found in LIMITED])
async def test_no_block_allows_values_out_of_range(bare_caller: Caller, key: str, name: str, end: str) -> None:
    """Blocks of six functions allowed times or volumes that the functions refuse."""
    function = next(function for function in FUNCTIONS if function["key"] == key)
    given = {parameter["name"]: parameter["default"] for parameter in function["parameters"]}
    for parameter in function["parameters"]:
        if parameter["kind"] == "choice":
            given[parameter["name"]] = 4000 if parameter["name"] == "audio_id" else 1
        elif parameter["default"] is None:
            given[parameter["name"]] = [] if parameter["kind"] == "list" else "x"
    given[name] = described(key, name)[end]
    try:
        said = refusal(await bare_caller(key, **given))
    except RobotError as error:
        said = str(error)
    assert "is outside of" not in said


async def test_dances_of_blocks_are_not_cut(bare_caller: Caller) -> None:
    for key, name, parts in (("push_up", "number", 2), ("moonwalk", "number", 4)):
        limits = described(f"choreographer.{key}", name)
        for number in (limits["minimum"], limits["maximum"]):
            others = (30,) if key == "push_up" else (0.05, 0.0, 0.03)
            await bare_caller(f"choreographer.{key}", *others, number)
            steps = bare_caller.session.part(Choreography).steps
            assert len(steps) - 2 * (key == "moonwalk") == parts * number  # a moonwalk has a head and a tail


def test_angles_of_places_are_in_rad() -> None:
    """The block said degrees: a robot sent to 90 stood at 90 rad."""
    for name in ("roll", "pitch", "yaw"):
        assert described("cyberdog.navigation.navigation_to_coordinates", name)["unit"] == "rad"
        assert described("cyberdog.motion.absolute_attitude", name)["unit"] == "°"
