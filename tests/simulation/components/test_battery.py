"""Draining, charging on the dock, running dry."""

import math
from itertools import product

import pytest

from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.errors import Refused
from roboglot.model.events import BatteryChanged, DockContactChanged
from roboglot.model.geometry import STILL, Pose, Twist
from tests.masking import mask_bumper


async def test_starts_on_the_dock_and_charges(simulate):
    sim = simulate()
    sim.world.start()
    await sim.clock.advance(10.0)
    state = sim.robot[Battery].state
    assert sim.robot[DockContact].docked
    assert state.charging
    assert state.current > 0
    assert state.current * state.voltage == pytest.approx(60.0, abs=1.5)  # less towards the end
    assert state.percentage == pytest.approx(0.9 + state.current * 10 / 3600 / state.capacity, abs=3e-5)
    assert sim.robot[Bumper].pressed == frozenset()


async def test_forward_leaves_the_dock_and_back_finds_it(simulate):
    sim = simulate()
    events = sim.robot.events.subscribe(DockContactChanged, BatteryChanged)
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.2))
    await sim.clock.advance(3.0)
    assert not sim.robot[DockContact].docked
    assert not sim.robot[Battery].state.charging
    sim.robot[Base].set_velocity(Twist(-0.2))
    await sim.clock.advance(3.2)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(0.5)
    assert sim.robot[DockContact].docked
    changes = [e.docked for e in events.drain() if isinstance(e, DockContactChanged)]
    assert changes == [False, True]


@pytest.mark.parametrize(
    ("offset", "docked"),
    [
        (Pose(0.25), True),
        (Pose(0.275, 0.02, math.radians(4)), True),
        (Pose(0.30), False),
        (Pose(0.26, 0.05), False),
        (Pose(0.26, 0.0, math.radians(8)), False),
        (Pose(0.26, 0.0, math.pi), False),
    ],
)
async def test_contacts_touch_only_near_and_straight(simulate, offset, docked):
    sim = simulate()
    sim.world.start()
    sim.world.stage.place("a", Pose(0.12, 5.0).compose(offset))
    await sim.clock.advance(0.02)
    assert sim.robot[DockContact].docked is docked


async def test_pushing_costs_more_than_driving_more_than_standing(simulate):
    async def power(start, twist):
        sim = simulate(start=start)
        mask_bumper(sim.robot)
        sim.world.start()
        sim.robot[Base].set_velocity(twist)
        await sim.clock.advance(1.0)
        before = sim.robot[Battery].state
        await sim.clock.advance(3.0)
        return (before.percentage - sim.robot[Battery].state.percentage) * before.capacity * before.voltage * 3600 / 3.0

    still = await power(Pose(2, 5), STILL)
    driving = await power(Pose(2, 5), Twist(1.0))
    pushing = await power(Pose(9.7, 5), Twist(1.0))
    assert still == pytest.approx(12.0, abs=0.5)
    assert still + 3 < driving < 40
    assert pushing > 2 * driving


BODIES, CHARGES = ("universal", "hermes", "cyberdog2", "robomaster_ep"), (0.98, 0.5, 0.08)
ONE_OF_EACH = {*zip(BODIES, (*CHARGES, 0.5), strict=True)}  # in every run


@pytest.mark.parametrize(
    ("body", "charge"),
    [pytest.param(*pair, marks=[] if pair in ONE_OF_EACH else pytest.mark.slow) for pair in product(BODIES, CHARGES)],
)
async def test_charge_is_the_integral_of_the_current(simulate, body, charge):
    sim = simulate(body=body, start=Pose(5, 5))
    battery = sim.robot[Battery]
    battery.set_charge(charge)
    sim.world.start()
    before, drawn, energy = battery.charge, 0.0, 0.0
    for speed in (0.0, 0.5, -0.3, 0.0):
        sim.robot[Base].set_velocity(Twist(speed))
        for _ in range(200):
            await sim.clock.advance(0.02)
            state = battery.state
            drawn -= state.current * 0.02 / 3600.0
            energy -= state.current * state.voltage * 0.02 / 3600.0
    fell = before - battery.charge
    assert fell > 0.0
    assert fell * state.capacity == pytest.approx(drawn, rel=0.01)
    assert energy / drawn == pytest.approx(state.voltage, rel=0.1)


async def test_a_full_discharge_is_the_capacity(simulate):
    sim = simulate(start=Pose(5, 5))
    battery = sim.robot[Battery]
    sim.world.start()
    await sim.clock.advance(1.0)
    energy = 0.0
    for percent in range(100):
        battery.set_charge((percent + 0.5) / 100.0)
        await sim.clock.advance(0.1)
        state = battery.state
        energy += state.voltage * state.capacity / 100.0
    assert energy == pytest.approx(100.0 * state.health, rel=0.01)


async def test_every_percent_is_reported(simulate):
    sim = simulate(start=Pose(5, 5))
    sim.robot[Battery].set_charge(0.9005)
    events = sim.robot.events.subscribe(BatteryChanged)
    sim.world.start()
    await sim.clock.advance(30.0)  # 12 W of 100 Wh: a percent in some 320 s
    assert [round(e.percentage, 3) for e in events.drain()] == [0.9]


async def test_voltage_falls_and_cells_warm_under_load(simulate):
    sim = simulate(start=Pose(9.7, 5))
    mask_bumper(sim.robot)
    sim.world.start()
    await sim.clock.advance(1.0)
    still = sim.robot[Battery].state
    sim.robot[Base].set_velocity(Twist(2.0))
    await sim.clock.advance(5.0)
    pushing = sim.robot[Battery].state
    assert pushing.voltage < still.voltage - 0.2
    assert pushing.temperature > still.temperature
    assert pushing.current < still.current < 0


async def test_empty_battery_stops_robot_until_it_is_charged(simulate):
    sim = simulate()
    battery = sim.robot[Battery]
    sim.world.start()
    sim.world.stage.place("a", Pose(5, 5))
    battery.set_charge(0.0)
    await sim.clock.advance(0.1)
    with pytest.raises(Refused, match="empty"):
        sim.robot[Base].set_velocity(Twist(0.5))
    battery.set_charge(0.018)
    sim.world.stage.place("a", Pose(0.37, 5.0))
    await sim.clock.advance(1.0)
    assert battery.state.charging
    with pytest.raises(Refused, match="empty"):
        sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(25.0)
    assert battery.charge > 0.02
    sim.robot[Base].set_velocity(Twist(0.5))


async def test_charging_ends_when_full(simulate):
    sim = simulate()
    battery = sim.robot[Battery]
    battery.set_charge(0.998)
    sim.world.start()
    await sim.clock.advance(0.1)
    assert not battery.state.charging  # above the level at which charging begins
    battery.set_charge(0.96)
    await sim.clock.advance(0.1)
    assert battery.state.charging
    battery.set_charge(0.99895)
    await sim.clock.advance(10.0)
    assert not battery.state.charging
    assert battery.state.percentage < 1.0
    assert battery.state.current == 0.0
