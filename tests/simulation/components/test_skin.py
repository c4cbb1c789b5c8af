"""Electronic skin: what each patch shows at which moment, and which leg stands."""

from __future__ import annotations

import pytest

from roboglot.model.components.interaction.skin import (
    CYCLE_MAX,
    ElectronicSkin,
    Patch,
    Shade,
    SkinPattern,
)
from roboglot.model.components.interaction.skin_effects import LEGS
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.feet import Foot
from roboglot.model.components.motion.legs import Legs
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import Pose, Twist

TRUNK = (Patch.FRONT, Patch.MIDDLE, Patch.REAR)


@pytest.fixture
def dog(simulate):
    sim = simulate(start=Pose(2, 5), body="cyberdog2")
    sim.world.start()
    return sim


@pytest.fixture
def skin(dog) -> ElectronicSkin:
    return dog.robot[ElectronicSkin]


def trunk(skin: ElectronicSkin) -> str:
    """Return a letter for each third, from the front."""
    return "".join("L" if skin.shades[patch] is Shade.LIGHT else "d" for patch in TRUNK)


async def seen(dog, steps: int, step: float) -> list[str]:
    found = []
    for _ in range(steps):
        found.append(trunk(dog.robot[ElectronicSkin]))
        await dog.clock.advance(step)
    return found


async def test_begins_dark_and_shows_what_it_gets(dog, skin) -> None:
    assert set(skin.shades) == set(Patch)
    assert set(skin.shades.values()) == {Shade.DARK}
    skin.show(SkinPattern.LIGHT)
    await dog.clock.advance(3.0)
    assert set(skin.shades.values()) == {Shade.LIGHT}


@pytest.mark.parametrize(
    ("pattern", "wanted"),
    [
        (SkinPattern.FLASH, ["LLL"] * 4 + ["ddd"] * 4 + ["LLL"]),
        (SkinPattern.REARWARD, ["Ldd", "Ldd", "LLd", "LLL", "dLL", "dLL", "ddL", "ddd", "Ldd"]),
        (SkinPattern.FORWARD, ["ddL", "ddL", "dLL", "LLL", "LLd", "LLd", "Ldd", "ddd", "ddL"]),
    ],
)
async def test_patterns_run_over_the_body(dog, skin, pattern, wanted) -> None:
    skin.show(pattern, cycle=2.0)
    await dog.clock.advance(0.02)
    assert await seen(dog, len(wanted), 0.5) == wanted
    assert skin.shades[Patch.LEFT_REAR_LEG] is skin.shades[Patch.REAR]


async def test_chance_draws_anew_every_cycle_repeatably_by_seed(dog, skin) -> None:
    skin.show(SkinPattern.RANDOM, cycle=0.5)
    await dog.clock.advance(0.02)
    first, within = await seen(dog, 16, 0.5), []
    assert len(set(first)) > 3
    skin.show(SkinPattern.RANDOM, cycle=0.5)
    await dog.clock.advance(0.02)
    for wanted in first:
        within.append(trunk(skin) == wanted)
        await dog.clock.advance(0.25)
        within.append(trunk(skin) == wanted)
        await dog.clock.advance(0.25)
    assert all(within)


@pytest.mark.parametrize("standing", Shade)
async def test_the_legs_that_stand_are_shown(dog, skin, standing) -> None:
    skin.show(SkinPattern.FOOTFALLS, standing=standing)
    other = Shade.DARK if standing is Shade.LIGHT else Shade.LIGHT
    assert all(skin.shades[leg] is standing for leg in LEGS)
    assert all(skin.shades[patch] is other for patch in TRUNK)
    walks = set()
    for _ in range(60):
        dog.robot[Base].set_velocity(Twist(x=0.4))
        await dog.clock.advance(0.02)
        feet, shades = dog.robot[Legs].feet, skin.shades
        assert {foot for leg, foot in LEGS.items() if shades[leg] is standing} == {f for f in Foot if feet[f].grounded}
        walks.add(frozenset(leg for leg in LEGS if shades[leg] is standing))
    assert len(walks) >= 2


async def test_dark_when_switched_off_and_takes_no_pattern(dog, skin) -> None:
    skin.show(SkinPattern.FLASH, cycle=1.0)
    skin.enable(False)
    assert await seen(dog, 3, 0.5) == ["ddd"] * 3
    with pytest.raises(Refused):
        skin.show(SkinPattern.LIGHT)
    skin.enable(True)  # the pattern starts over
    assert await seen(dog, 4, 0.5) == ["LLL", "LLL", "ddd", "ddd"]


@pytest.mark.parametrize("cycle", [0.0, -1.0, CYCLE_MAX + 1.0, float("nan"), float("inf")])
async def test_cycles_that_cannot_be(skin, cycle) -> None:
    with pytest.raises(InvalidGoal):
        skin.show(SkinPattern.FLASH, cycle=cycle)
    assert skin.state.pattern is SkinPattern.DARK


async def test_body_on_wheels_has_no_legs_to_show(simulate) -> None:
    sim = simulate(start=Pose(2, 5), body="universal")
    sim.world.start()
    skin = sim.robot[ElectronicSkin]
    assert set(skin.shades) == set(TRUNK)
    with pytest.raises(Refused):
        skin.show(SkinPattern.FOOTFALLS)
