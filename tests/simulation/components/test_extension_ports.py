"""Servos, PWM outputs and sensor adapters."""

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.system.pwm import PwmPorts, PwmSignal
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.events import AdapterLevelChanged


@pytest.fixture
def sim(simulate):
    sim = simulate(body="robomaster_ep")
    sim.world.start()
    return sim


@pytest.fixture
def servos(sim):
    return sim.robot[Servos]


async def test_servo_goes_to_an_angle_at_a_speed(sim, servos):
    action = servos.move_to(2, 1.0, speed=0.5)
    await sim.clock.advance(1.0)
    assert servos.angle(2) == pytest.approx(0.5, abs=0.03)
    await sim.clock.advance(1.2)
    assert action.status is ActionStatus.SUCCEEDED
    assert servos.angle(2) == pytest.approx(1.0)
    assert servos.angle(1) == servos.angle(3) == 0.0


async def test_servos_are_moved_one_by_one(sim, servos):
    first, second = servos.move_to(1, 1.0, speed=1.0), servos.move_to(3, -2.0, speed=1.0)
    await sim.clock.advance(2.2)
    assert first.status is second.status is ActionStatus.SUCCEEDED
    assert (servos.angle(1), servos.angle(3)) == (pytest.approx(1.0), pytest.approx(-2.0))


async def test_a_servo_keeps_turning_until_it_is_stopped(sim, servos):
    turning = servos.set_speed(1, math.pi, source="me")
    await sim.clock.advance(1.5)
    assert servos.angle(1) == pytest.approx(-math.pi / 2, abs=0.1)  # three quarters of two turns
    assert servos.set_speed(1, -math.pi, source="me") is turning
    await sim.clock.advance(1.0)
    servos.stop()
    await sim.clock.advance(0.1)
    there = servos.angle(1)
    assert turning.status is ActionStatus.CANCELED
    await sim.clock.advance(1.0)
    assert servos.angle(1) == there


async def test_servo_that_has_turned_round_goes_short_way(sim, servos):
    servos.set_speed(1, 4 * math.pi)
    await sim.clock.advance(1.1)
    servos.stop()
    begun = servos.angle(1)
    action = servos.move_to(1, begun + 0.2, speed=1.0)
    await sim.clock.advance(0.5)
    assert action.status is ActionStatus.SUCCEEDED
    assert servos.angle(1) == pytest.approx(begun + 0.2)


async def test_a_servos_bounds(servos):
    for bad in (0, 4):
        with pytest.raises(NotFound):
            servos.angle(bad)
        with pytest.raises(NotFound):
            servos.stop(bad)
    for bad in (4.0, math.nan):
        with pytest.raises(InvalidGoal):
            servos.move_to(1, bad)
    with pytest.raises(InvalidGoal):
        servos.set_speed(1, math.inf)


async def test_pwm_ports_put_out_what_they_are_given(sim):
    ports = sim.robot[PwmPorts]
    assert ports.signal(6) == PwmSignal(0.125, 50.0)
    ports.set_duty(2, 0.4)
    ports.set_frequency(2, 1000.0)
    ports.set_duty(3, 1.0)
    assert [ports.signal(port) for port in (1, 2, 3)] == [
        PwmSignal(0.125, 50.0),
        PwmSignal(0.4, 1000.0),
        PwmSignal(1.0, 50.0),
    ]
    for refused in (lambda: ports.set_duty(1, 1.1), lambda: ports.set_frequency(1, 0.0)):
        with pytest.raises(InvalidGoal):
            refused()
    with pytest.raises(NotFound):
        ports.set_duty(7, 0.5)
    ports.reset()
    assert ports.signal(2) == PwmSignal(0.125, 50.0)


async def test_adapters_measure_what_lies_at_their_inputs(sim):
    adapters = sim.robot[SensorAdapters]
    levels = sim.robot.events.subscribe(AdapterLevelChanged)
    await sim.clock.advance(1.0)
    sim.world.stage.apply_voltage("a", 2, 1, 3.0)
    assert (adapters.voltage(2, 1), adapters.level(2, 1), adapters.pulse_period(2, 1)) == (3.0, True, 0.0)
    assert (adapters.voltage(2, 2), adapters.level(2, 2)) == (0.0, False)
    await sim.clock.advance(0.25)
    sim.world.stage.apply_voltage("a", 2, 1, 2.0)  # still high
    await sim.clock.advance(0.25)
    sim.world.stage.apply_voltage("a", 2, 1, 0.5)
    assert adapters.pulse_period(2, 1) == pytest.approx(0.5)
    reported = [(event.stamp, event.adapter, event.port, event.level) for event in levels.drain()]
    assert reported == [(pytest.approx(1.0), 2, 1, True), (pytest.approx(1.5), 2, 1, False)]


async def test_an_adapters_bounds(sim):
    for place in ((0, 1), (7, 1), (1, 0), (1, 3)):
        with pytest.raises(NotFound):
            sim.robot[SensorAdapters].level(*place)
    with pytest.raises(InvalidGoal):
        sim.world.stage.apply_voltage("a", 1, 1, 3.4)
