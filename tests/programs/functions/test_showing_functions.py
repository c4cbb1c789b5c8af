"""cyberdog.led and cyberdog.audio: what is shown and what is heard."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from roboglot.media.tunes import evening_waltz, romp
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.light import (
    DARK,
    Colour,
    Light,
    LightEffect,
)
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.errors import RobotError
from roboglot.model.events import SoundPlayed, Spoke
from roboglot.model.sensing import BatteryState
from roboglot.model.sound import Sound
from roboglot.programs.functions.audio import bark
from roboglot.programs.functions.enums import ENUMS
from roboglot.simulation.world.world import World
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("empty", body="cyberdog2")
LED = ENUMS["LedConstraint"]


def code(result: object) -> int:
    return int(field(result, "response.code"))


@pytest.mark.parametrize(
    ("effect", "look", "colour"),
    [
        ("system_effect_line_red_on", LightEffect.SOLID, Colour(255, 0, 0)),
        ("system_effect_line_blue_blink_fast", LightEffect.FLASH, Colour(0, 0, 255)),
        ("system_effect_line_yellow_breath", LightEffect.BREATH, Colour(255, 255, 0)),
        ("system_effect_line_yellow_one_by_one_fast", LightEffect.FILLING, Colour(255, 255, 0)),
        ("system_effect_line_off", LightEffect.OFF, DARK),
    ],
)
async def test_system_effects(caller: Caller, effect: str, look: LightEffect, colour: Colour) -> None:
    result = await caller("cyberdog.led.play", LED["target_tail"], LED[effect])
    assert (field(result, "state.code"), code(result)) == (0, 0)
    shown = caller.robot[Light].state("tail")
    assert (shown.effect, shown.colour) == (look, colour)


async def test_own_colours_and_the_eyes(caller: Caller) -> None:
    light = caller.robot[Light]
    assert code(await caller("cyberdog.led.play_rgb", LED["target_head"], LED["effect_line_on"], 1, 2, 3)) == 0
    assert light.lamps("head") == (Colour(1, 2, 3),) * light.zones["head"]
    ring = LED["effect_mini_circular_ring"]
    assert code(await caller("cyberdog.led.play_rgb", LED["target_mini"], ring, 9, 9, 9)) == 0
    assert light.state("eyes").effect is LightEffect.SCROLLING
    one_by_one = LED["system_effect_mini_one_by_one"]
    assert code(await caller("cyberdog.led.play", LED["target_mini"], one_by_one)) == 0
    assert light.state("eyes").effect is LightEffect.FILLING


@pytest.mark.parametrize(
    ("figure", "look", "shining"),
    [
        ("rectangle_color", LightEffect.CORNERS, 4),
        ("centre_color", LightEffect.BAND, 4),
        ("three_circular", LightEffect.TRIAD, 3),
    ],
)
async def test_the_figures_of_the_eyes(caller: Caller, figure: str, look: LightEffect, shining: int) -> None:
    result = await caller("cyberdog.led.play", LED["target_mini"], LED[f"system_effect_mini_{figure}"])
    assert (field(result, "state.code"), code(result)) == (0, 0)
    light = caller.robot[Light]
    assert light.state("eyes").effect is look
    seen = set()
    for _ in range(8):
        await caller.clock.advance(0.26)
        lamps = light.lamps("eyes")
        seen.add(lamps)
        assert sum(lamp != DARK for lamp in lamps) <= max(shining, len(lamps) // 2)
    assert len(seen) > 3


@pytest.mark.parametrize(
    ("name", "args", "expected"),
    [
        ("play", (4, 161), 1121),
        ("play", (1, 1), 1124),  # one of play_rgb's
        ("play", (1, 54), 1124),  # one of the eyes'
        ("play", (1, 51), 1124),  # a figure for the eyes
        ("play_rgb", (1, 161, 0, 0, 0), 1124),
        ("play_rgb", (1, 1, 256, 0, 0), 1124),
        ("play_rgb", (1, 1, 0, -1, 0), 1124),
        ("freed", (0,), 1121),
    ],
)
async def test_invalid_lights_change_nothing(caller: Caller, name: str, args: tuple[int, ...], expected: int) -> None:
    before = [caller.robot[Light].state(zone) for zone in ("head", "tail", "eyes")]
    result = await caller(f"cyberdog.led.{name}", *args)
    assert (field(result, "state.code"), code(result)) == (1, expected)
    assert [caller.robot[Light].state(zone) for zone in ("head", "tail", "eyes")] == before


async def test_lights_are_given_back(caller: Caller) -> None:
    light = caller.robot[Light]
    light.shine("head", Colour(7, 7, 7), LightEffect.BREATH, frequency=1.0)
    for effect in (1, 2):
        await caller("cyberdog.led.play_rgb", 1, effect, 255, 255, 255)
        await caller("cyberdog.led.play_rgb", 2, effect, 255, 255, 255)
    assert code(await caller("cyberdog.led.freed", 1)) == 0
    assert (light.state("head").colour, light.state("head").effect) == (Colour(7, 7, 7), LightEffect.BREATH)
    assert light.state("tail").effect is LightEffect.FLASH
    caller.session.cancel("the program has ended")
    assert light.state("tail").effect is LightEffect.OFF
    assert light.state("head").colour == Colour(7, 7, 7)


RED, BLUE = Colour(255, 0, 0), Colour(0, 0, 255)


@pytest.mark.parametrize("first_ends", [True, False])
async def test_two_programs_take_one_light(caller: Caller, second_caller: Caller, first_ends: bool) -> None:
    """The first program's end darkened the second's light, and the second's end left the first's for good."""
    light = caller.robot[Light]
    light.shine("head", Colour(7, 7, 7), LightEffect.BREATH, frequency=1.0)
    await caller("cyberdog.led.play_rgb", 1, 1, 255, 0, 0)
    await second_caller("cyberdog.led.play_rgb", 1, 1, 0, 0, 255)
    ending, other = (caller, second_caller) if first_ends else (second_caller, caller)
    ending.session.cancel("the program has ended")
    assert light.state("head").colour == (BLUE if first_ends else RED)
    assert code(await other("cyberdog.led.freed", 1)) == 0
    shown = light.state("head")
    assert (shown.colour, shown.effect, shown.frequency) == (Colour(7, 7, 7), LightEffect.BREATH, 1.0)


async def test_lights_of_programs_in_turn(caller: Caller, second_caller: Caller) -> None:
    light = caller.robot[Light]
    for program in (caller, second_caller, caller):
        await program("cyberdog.led.play_rgb", 2, 1, 255, 0, 0)
        await program("cyberdog.led.play_rgb", 1, 1, 255 * (program is caller), 0, 255 * (program is second_caller))
    caller.session.cancel("the program has ended")
    assert light.state("head").colour == BLUE
    second_caller.session.cancel("the program has ended")
    assert {light.state(zone).effect for zone in ("head", "tail")} == {LightEffect.OFF}


async def test_lights_of_another_client_stay(caller: Caller) -> None:
    light = caller.robot[Light]
    await caller("cyberdog.led.play_rgb", 1, 1, 255, 0, 0)
    light.shine("head", Colour(1, 2, 3), LightEffect.SOLID)
    caller.session.cancel("the program has ended")
    assert light.state("head").colour == Colour(1, 2, 3)
    await caller("cyberdog.led.play_rgb", 1, 1, 255, 0, 0)
    await caller("cyberdog.led.freed", 1)
    assert light.state("head").colour == Colour(1, 2, 3)


async def test_one_stuck_light_keeps_no_others(caller: Caller, monkeypatch: pytest.MonkeyPatch) -> None:
    light = caller.robot[Light]
    for target in (1, 2, 3):
        await caller("cyberdog.led.play_rgb", target, 48 if target == 3 else 1, 255, 0, 0)
    shine = light.shine

    def stuck(zone: str, *args: Any, **kwargs: Any) -> None:
        if zone == "head":
            raise RobotError("the head does not answer")
        shine(zone, *args, **kwargs)

    monkeypatch.setattr(light, "shine", stuck)
    caller.session.cancel("the program has ended")
    assert [light.state(zone).effect for zone in ("tail", "eyes")] == [LightEffect.OFF] * 2


@pytest.mark.world("empty", body="hermes")
async def test_no_such_light_is_not_freed(caller: Caller) -> None:
    assert code(await caller("cyberdog.led.play", 1, 161)) == 1121
    assert code(await caller("cyberdog.led.freed", 1)) == 1121


class NearlyEmpty(Battery):
    @property
    def state(self) -> BatteryState:
        return BatteryState(0.15, 24.0, -1.0, 25.0, False, 1)


async def test_low_power_comes_first(caller: Caller, bare_caller: Caller) -> None:
    caller.robot._components[Battery] = NearlyEmpty()
    assert code(await caller("cyberdog.led.play", 1, 161)) == 1125
    assert caller.robot[Light].state("head").effect is LightEffect.OFF
    assert code(await bare_caller("cyberdog.led.play", 1, 161)) == 1107
    assert code(await bare_caller("cyberdog.led.freed", 1)) == 1107


async def test_saying_takes_its_time_and_its_turn(caller: Caller) -> None:
    with caller.robot.events.subscribe(Spoke) as said:
        first = caller.start("cyberdog.audio.instantly_play", "one two three four five six")
        await caller.clock.advance(0.1)
        assert field(first.result(), "code") == 0
        result = await caller("cyberdog.audio.play", "hello ", "world", " again", volume=30)
        assert field(result, "response.status") == 0
        texts = [(await said.next()).text for _ in range(2)]
    assert texts == ["one two three four five six", "hello world again"]
    assert field(await caller("cyberdog.audio.get_volume"), "response.volume") == 30


async def test_programs_speak_in_turn(caller: Caller, second_caller: Caller) -> None:
    """Of two that waited for a third, one was cut off by the other, and failed."""
    third = Caller(caller.robot, caller.clock, "third")
    with caller.robot.events.subscribe(Spoke) as said:
        speaking = [
            program.start("cyberdog.audio.play", text, 40)
            for program, text in ((caller, "one one one"), (second_caller, "two two two"), (third, "three three"))
        ]
        for _ in range(600):
            await caller.clock.advance(0.05)
            if all(call.done() for call in speaking):
                break
        assert [field(call.result(), "response.status") for call in speaking] == [0, 0, 0]
        assert {(await said.next()).text for _ in speaking} == {"one one one", "two two two", "three three"}


async def test_at_once_takes_over(caller: Caller) -> None:
    long = caller.start("cyberdog.audio.play", "a sentence that takes quite some time to be said to its end")
    await caller.clock.advance(0.5)
    assert field(await caller("cyberdog.audio.instantly_play", "stop"), "code") == 0
    await caller.clock.advance(0.5)
    assert (field(long.result(), "state.code"), field(long.result(), "response.status")) == (1, 1)


async def test_a_bark_is_heard(caller: Caller) -> None:
    with caller.robot[Microphone].subscribe() as ear, caller.robot.events.subscribe(SoundPlayed) as played:
        start = caller.clock.time()
        result = await caller("cyberdog.audio.offline_play", 4001, 80)
        assert field(result, "response.status") == 0
        assert caller.clock.time() - start == pytest.approx(bark(4001).seconds, abs=0.1)
        await played.next()
        assert max(abs(int(block.samples.min())) for block in ear.drain()) > 2000
    assert field(await caller("cyberdog.audio.offline_instantly_play", 4000), "code") == 0


@pytest.mark.parametrize(("number", "piece"), [(6000, romp), (6001, evening_waltz)])
async def test_music_is_heard_to_its_end(caller: Caller, number: int, piece: Callable[[], Sound]) -> None:
    with caller.robot[Microphone].subscribe() as ear:
        start = caller.clock.time()
        result = await caller("cyberdog.audio.offline_play", number, 80)
        assert (field(result, "state.code"), field(result, "response.status")) == (0, 0)
        assert caller.clock.time() - start == pytest.approx(piece().seconds, abs=0.1)
        assert max(abs(int(block.samples.min())) for block in ear.drain()) > 1000
    assert field(await caller("cyberdog.audio.offline_instantly_play", number), "code") == 0


@pytest.mark.parametrize(
    ("name", "args"),
    [
        ("play", ("hello", 101)),
        ("play", ("",)),
        ("play", ("x" * 1001, 35)),
        ("offline_play", (6002,)),
        ("offline_play", (4000, -2)),
    ],
)
async def test_invalid_sounds_play_nothing(caller: Caller, name: str, args: tuple[object, ...]) -> None:
    before = caller.robot[Speaker].volume
    result = await caller(f"cyberdog.audio.{name}", *args)
    assert (field(result, "state.code"), field(result, "response.status")) == (1, 1)
    instant = await caller(f"cyberdog.audio.{name.replace('play', 'instantly_play')}", *args)
    assert field(instant, "code") == 1
    assert caller.robot[Speaker].volume == before
    assert field(await caller("cyberdog.audio.state"), "code") == 1


async def test_volume(caller: Caller) -> None:
    speaker = caller.robot[Speaker]
    for volume, success in ((0, True), (100, True), (55, True), (-1, True), (101, False), (-5, False)):
        result = await caller("cyberdog.audio.set_volume", volume)
        assert field(result, "response.success") is success
    assert speaker.volume == 0.55


async def test_volume_on_a_full_disk_is_refused(caller: Caller, world: World) -> None:
    before = caller.robot[Speaker].volume
    world.faults.inject("full_disk", "a")
    assert field(await caller("cyberdog.audio.set_volume", 35), "response.success") is False
    assert field(await caller("cyberdog.audio.play", "hello", 35), "response.status") == 1
    assert caller.robot[Speaker].volume == before


async def test_without_a_loudspeaker(bare_caller: Caller) -> None:
    assert field(await bare_caller("cyberdog.audio.play", "hello"), "response.status") == 1
    assert field(await bare_caller("cyberdog.audio.set_volume", 5), "response.success") is False
