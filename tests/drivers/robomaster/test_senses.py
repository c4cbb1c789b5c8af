"""Senses of an EP through a driver: a simulated EP behind its door in two builds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roboglot.media.audio import AudioStream
from roboglot.model.components.interaction.input_device import Input, InputDevice, MouseButton
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.components.system.pwm import PwmPorts, PwmSignal
from roboglot.model.errors import Busy, NotFound, Refused, Unconnected
from roboglot.model.events import AdapterLevelChanged
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Colour
from roboglot.model.robot import Robot
from roboglot.model.sound import claps, tone
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.drivers.clients import Open, Until
from tests.drivers.rig import cut_session
from tests.drivers.settling import settle

pytestmark = pytest.mark.world("empty", body="robomaster_ep")


@pytest.fixture(params=["fw70", pytest.param("spec", marks=pytest.mark.slow)])
def profile(request: pytest.FixtureRequest) -> str:
    """Both profiles: the manual's, and robots'."""
    return str(request.param)


async def test_pwm_outputs_hold_also_after_a_lost_link(
    driven_ep: Robot, robot: Robot, text_door: Open, until: Until
) -> None:
    script, pwm = await text_door(driven_ep), driven_ep[PwmPorts]
    assert await script.ask("pwm value 2 40;") == "ok"
    assert await script.ask("pwm freq 2 1000;") == "ok"
    await until(lambda: robot[PwmPorts].signal(2) == PwmSignal(0.4, 1000.0))
    assert pwm.signal(2) == PwmSignal(0.4, 1000.0)
    with pytest.raises(NotFound):
        pwm.set_duty(7, 0.5)
    cut_session(driven_ep[Base])
    await until(lambda: driven_ep[Link].state is LinkState.LOST)
    with pytest.raises(Unconnected):
        pwm.set_duty(2, 0.5)
    await until(lambda: driven_ep[Link].state is LinkState.UP)
    await until(lambda: robot[PwmPorts].signal(2) == PwmSignal(0.4, 1000.0))


async def test_sensor_adapters_report_volts_levels_and_periods(
    driven_ep: Robot, robot: Robot, world: World, text_door: Open, until: Until, forward: Forward
) -> None:
    script, adapters = await text_door(driven_ep), driven_ep[SensorAdapters]
    changes: list[AdapterLevelChanged] = []
    driven_ep.events.listen(AdapterLevelChanged, changes.append)
    for voltage in (0.5, 2.0, 1.0, 2.5):
        world.stage.apply_voltage("a", 5, 2, voltage)
        await forward(seconds=0.1)
        await settle()
    await until(lambda: adapters.voltage(5, 2) == pytest.approx(2.5, abs=0.01), patience=2)
    assert adapters.level(5, 2)
    assert not adapters.level(5, 1)
    assert [(change.adapter, change.port, change.level) for change in changes] == [(5, 2, on) for on in (1, 0, 1)]
    real = robot[SensorAdapters].pulse_period(5, 2)
    await until(lambda: adapters.pulse_period(5, 2) == pytest.approx(real, abs=0.001), patience=2)
    assert adapters.count == 6
    assert await script.numbers("sensor_adapter adc id 5 port 2 ?;") == pytest.approx([2.5], abs=0.01)
    with pytest.raises(NotFound):
        adapters.voltage(7, 1)


@pytest.mark.slow
async def test_its_microphone_and_applause_reach_the_next_robot(
    driven_ep: Robot, world: World, until: Until, forward: Forward
) -> None:
    beside = Point(world.truth.pose_of("a").x + 1.0, world.truth.pose_of("a").y)
    with driven_ep[Microphone].subscribe() as blocks, driven_ep[AudioStream].subscribe() as packets:
        heard = blocks.drain()
        await until(lambda: packets.drain())
        world.stage.make_sound(tone(1000.0, 0.4), beside)
        for _ in range(40):
            await forward(seconds=0.02)
            await settle()
            heard += blocks.drain()
    loudest = max(heard, key=lambda block: float(np.square(block.samples.astype(float)).mean()))
    spectrum = np.abs(np.fft.rfft(loudest.samples))
    assert abs(int(spectrum.argmax()) * 50 - 1000) <= 50
    with pytest.raises(Refused):
        driven_ep[Hearing].speech()
    with driven_ep[Hearing].claps() as runs:
        await forward(seconds=0.2)
        world.stage.make_sound(claps(3), beside)
        reported = runs.drain()
        for _ in range(30):
            await forward(seconds=0.1)
            await settle()
            reported += runs.drain()
        assert [run.count for run in reported] == [3]


@pytest.mark.world("playground", body="robomaster_ep")
async def test_it_sees_people_markers_and_lines(
    driven_ep: Robot, robot: Robot, world: World, until: Until, forward: Forward
) -> None:
    vision, anna = driven_ep[Vision], world.stage.person("anna").pose
    world.stage.place("a", Pose(anna.x - 2.5, anna.y + 0.3, 0.0))
    with vision.people.subscribe() as watching:
        with pytest.raises(Busy):
            vision.markers.subscribe()
        await until(lambda: vision.people.latest is not None and vision.people.latest.seen)
        seen = watching.drain()[-1].seen[0]
        place = anna.relative_to(world.truth.pose_of("a"))
        assert (seen.place.x, seen.place.y) == pytest.approx((place.x, place.y), abs=0.4)
        await forward(seconds=0.5)
        assert {look.seen[0].number for look in watching.drain()} == {seen.number}  # the nearest one stays the same
    world.stage.place(
        "a", Pose(4.0, 1.5, -math.pi / 2)
    )  # in front of the south wall: left (red), forward (blue), right (red)
    with vision.markers.subscribe(), vision.lines.subscribe():
        await until(lambda: vision.markers.latest is not None and len(vision.markers.latest.seen) > 1)
        assert vision.markers.latest
        reported = {marker.symbol: marker for marker in vision.markers.latest.seen}
        assert reported["forward"].colour is Colour.BLUE
        assert all(reported[symbol].colour is Colour.RED for symbol in reported if symbol != "forward")
        assert reported["forward"].distance == pytest.approx(
            1.4 * 0.17 / 0.3, abs=0.1
        )  # assumed to be as small as the maker's
        await until(lambda: vision.lines.latest is not None and vision.lines.latest.seen)
        assert vision.lines.latest
        with robot[Vision].lines.subscribe():
            await until(lambda: robot[Vision].lines.latest)
            real = robot[Vision].lines.latest
            assert real
            assert {line.colour for line in vision.lines.latest.seen} == {line.colour for line in real.seen}
    with pytest.raises(Refused):
        vision.faces.subscribe()


async def test_the_pilots_keys_and_mouse_are_handed_on(driven_ep: Robot, robot: Robot, until: Until) -> None:
    near, far = driven_ep[InputDevice], robot[InputDevice]
    heard: list[Input] = []
    stop = near.listen(heard.append)
    await until(lambda: True)
    for key in ("w", "7", "shift"):
        far.press(key)
    far.click(MouseButton.LEFT)
    far.move_mouse(-0.5, 0.25)
    await until(lambda: near.state == far.state)
    assert heard[-1] == Input(("w", "7", "shift"), frozenset({MouseButton.LEFT}), -0.5, 0.25)
    far.release("w")
    await until(lambda: near.state.keys == ("7", "shift"))
    stop()
    with pytest.raises(Refused):
        near.press("a")
