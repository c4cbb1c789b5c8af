"""Lights: what one sees at which moment."""

import pytest

from roboglot.model.components.interaction.light import (
    DARK,
    WHITE,
    Colour,
    Light,
    LightEffect,
)
from roboglot.model.errors import InvalidGoal, NotFound

RED = Colour(200, 0, 0)


@pytest.fixture
def sim(simulate):
    return simulate(body="robomaster_ep")


@pytest.fixture
def light(sim):
    return sim.robot[Light]


async def seen(sim, zone, steps, step):
    found = []
    for _ in range(steps):
        found.append(sim.robot[Light].lamps(zone)[0].red)
        await sim.clock.advance(step)
    return found


async def test_it_begins_dark(light):
    assert set(light.zones) == {"front", "rear", "left", "right", "gimbal_left", "gimbal_right"}
    assert all(lamp == DARK for zone in light.zones for lamp in light.lamps(zone))


async def test_solid_and_off(sim, light):
    light.shine("front", RED)
    assert light.lamps("front") == (RED,)
    assert light.lamps("rear") == (DARK,)
    light.shine("front", RED, LightEffect.OFF)
    assert light.lamps("front") == (DARK,)


async def test_flash_is_on_for_half_of_the_period(sim, light):
    light.shine("left", RED, LightEffect.FLASH, frequency=2.0)
    assert await seen(sim, "left", 10, 0.1) == [200, 200, 200, 0, 0] * 2


async def test_breath_swells_and_fades(sim, light):
    light.shine("left", RED, LightEffect.BREATH, frequency=1.0)
    assert await seen(sim, "left", 5, 0.25) == [0, 100, 200, 100, 0]


async def test_pulse_jumps_up_and_fades(sim, light):
    light.shine("left", RED, LightEffect.PULSE, frequency=1.0)
    values = await seen(sim, "left", 5, 0.25)
    assert values[0] == values[4] == 200
    assert values[0] > values[1] > values[2] > values[3] > 0


async def test_scrolling_goes_round_the_ring(sim, light):
    light.shine("gimbal_left", RED, LightEffect.SCROLLING, frequency=1.0)
    brightest = []
    for _ in range(8):
        lamps = [lamp.red for lamp in light.lamps("gimbal_left")]
        brightest.append(lamps.index(max(lamps)))
        assert sum(value > 0 for value in lamps) == 3
        await sim.clock.advance(0.125)
    assert brightest == list(range(8))


async def test_a_single_lamp_of_a_ring(light):
    light.shine("gimbal_right", RED)
    light.shine("gimbal_right", WHITE, lamp=3)
    assert light.lamps("gimbal_right") == (RED, RED, RED, WHITE, RED, RED, RED, RED)
    assert light.state("gimbal_right").colour == WHITE


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ({"zone": "roof"}, NotFound),
        ({"zone": "front", "colour": Colour(256, 0, 0)}, InvalidGoal),
        ({"zone": "front", "frequency": 0.0}, InvalidGoal),
        ({"zone": "front", "effect": LightEffect.SCROLLING}, InvalidGoal),
        ({"zone": "gimbal_left", "lamp": 8}, NotFound),
        ({"zone": "gimbal_left", "lamp": 1, "effect": LightEffect.BREATH}, InvalidGoal),
    ],
)
async def test_invalid_lights_are_refused(light, given, error):
    with pytest.raises(error):
        light.shine(**given)
    assert light.lamps("front") == (DARK,)


async def test_figures_of_the_eyes(sim, light):
    light.shine("gimbal_left", WHITE, LightEffect.CORNERS, frequency=0.5)
    assert [index for index, lamp in enumerate(light.lamps("gimbal_left")) if lamp != DARK] == [0, 2, 4, 6]
    light.shine("gimbal_left", RED, LightEffect.BAND, frequency=0.5)
    before = light.lamps("gimbal_left")
    assert [index for index, lamp in enumerate(before) if lamp != DARK] == [2, 6]
    await sim.clock.advance(0.7)
    assert light.lamps("gimbal_left")[2] != before[2]  # another hue
    light.shine("gimbal_left", WHITE, LightEffect.TRIAD, frequency=0.5)
    assert set(light.lamps("gimbal_left")) == {DARK}  # initially dark
    await sim.clock.advance(1.0)
    assert [index for index, lamp in enumerate(light.lamps("gimbal_left")) if lamp == WHITE] == [0, 3, 5]
