"""Time of flight, ultrasonic, touch, GPS, motor temperatures, charging: against the world's geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.light import Colour, Light, LightEffect
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import BodyPose, Legs
from roboglot.model.components.motion.motions import Motion
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.sensing.gps import Gps, GpsFix
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.model.components.sensing.touch import Touch, TouchKind
from roboglot.model.components.system.health import Health
from roboglot.model.errors import ComponentMissing, NotFound, Refused
from roboglot.model.events import BatteryChanged, Touched
from roboglot.model.geometry import Orientation, Pose, Twist
from roboglot.model.sensing import Supply

EYE, UP, PITCH = 0.26, 0.22 + 0.04, 0.5  # of the CyberDog 2's head sensors: ahead, above the floor, nose down


@pytest.fixture
def dog(simulate):
    sim = simulate(start=Pose(5, 5), body="cyberdog2")
    sim.world.start()
    return sim


async def test_tof_sees_the_floor_ahead(dog):
    await dog.clock.advance(0.1)
    grid = dog.robot[TimeOfFlight].reading("head left").distances
    assert grid.shape == (8, 8)
    # The zone rows see PITCH +- half the field down: each meets the floor at height / sine (columns: over cosine).
    edge = math.tan(0.785 / 2) * 7 / 8
    for row in (4, 7):
        z, y = edge - row * 2 * edge / 7, edge / 7
        down = math.sin(PITCH) * 1.0 - math.cos(PITCH) * z
        expected = UP * math.sqrt(1 + y * y + z * z) / down
        assert grid[row, 3] == pytest.approx(expected, abs=0.02), row
    assert np.isposinf(grid[0]).all()  # the upper rows see beyond the sensor's range


async def test_tof_sees_an_obstacle_on_its_side_only(dog):
    dog.world.stage.add_obstacle(Pose(5.6, 5.25), (0.1, 0.4, 0.6))  # front face 0.55 ahead, left of the middle
    await dog.clock.advance(0.1)
    tof = dog.robot[TimeOfFlight]
    before = tof.reading("head right").distances[3, 6]
    left = tof.reading("head left").distances
    assert 0.25 < left[2].min() < 0.36
    assert before > left[2].min() + 0.1
    assert np.array_equal(tof.reading("head left").distances, left)  # no faster than its rate
    await dog.clock.advance(0.1)
    assert not np.array_equal(tof.reading("head left").distances, left)
    with pytest.raises(NotFound):
        tof.reading("nose")


async def test_tof_reports_too_near(dog):
    dog.world.stage.place("a", Pose(9.68, 5.0))
    await dog.clock.advance(0.2)
    grid = dog.robot[TimeOfFlight].reading("head left").distances
    assert np.isneginf(grid[:5]).all()


async def test_tof_turns_with_the_body(dog):
    tof = dog.robot[TimeOfFlight]
    await dog.clock.advance(0.2)
    level = float(np.min(tof.reading("head right").distances))
    dog.robot[Legs].hold(BodyPose(attitude=Orientation(pitch=0.3)), duration=0.2)
    await dog.clock.advance(0.5)
    assert float(np.min(tof.reading("head right").distances)) < level - 0.05  # nose down: the floor is nearer
    dog.robot[Legs].hold(BodyPose(attitude=Orientation(pitch=-0.3)), duration=0.2)
    await dog.clock.advance(0.5)
    assert float(np.min(tof.reading("head right").distances)) > level + 0.05


async def test_ultrasonic(dog):
    sensors = dog.robot[RangeSensors]
    sensors.measure(True)
    dog.world.stage.place("a", Pose(8.75, 5.0))
    await dog.clock.advance(0.2)
    assert sensors.reading("ultrasonic").distance == pytest.approx(10.0 - 8.75 - 0.25, abs=0.05)


async def test_touch(dog):
    events = dog.robot.events.subscribe(Touched)
    assert dog.robot[Touch].last is None
    await dog.clock.advance(1.0)
    dog.world.stage.touch("a", TouchKind.LONG)
    dog.world.stage.touch("a", TouchKind.DOUBLE)
    assert [event.kind for event in events.drain()] == [TouchKind.LONG, TouchKind.DOUBLE]
    assert dog.robot[Touch].last == (1.0, TouchKind.DOUBLE)
    with pytest.raises(NotFound):
        dog.world.stage.touch("unknown")


def test_a_body_without_a_pad_cannot_be_touched(simulate):
    with pytest.raises(ComponentMissing):
        simulate(body="hermes").world.stage.touch("a")


async def test_gps_under_the_open_sky(simulate):
    sim = simulate("yard", start=Pose(20, 10), body="cyberdog2")
    sim.world.start()
    gps = sim.robot[Gps]
    await sim.clock.advance(5.0)
    assert gps.reading.fix is GpsFix.NONE
    await sim.clock.advance(20.0)
    assert gps.reading.fix is GpsFix.PLANE
    await sim.clock.advance(30.0)
    here = gps.reading
    assert here.fix is GpsFix.SPACE
    assert here.satellites >= 10
    # 111 km to a degree; east is +x, north +y from the world's origin.
    assert here.latitude == pytest.approx(39.9042 + 10 / 111_035, abs=8 / 111_035)
    assert here.longitude == pytest.approx(116.4074 + 20 / (111_320 * math.cos(math.radians(39.9))), abs=8 / 85_000)
    assert here.altitude == pytest.approx(44.0, abs=15.0)
    sim.world.stage.place("a", Pose(30, 10))
    await sim.clock.advance(2.0)
    moved = gps.reading
    metres = (moved.longitude - here.longitude) * 111_320 * math.cos(math.radians(39.9))
    assert metres == pytest.approx(10.0, abs=2.5)  # errors wander slowly


async def test_no_gps_indoors(simulate):
    sim = simulate("empty", body="cyberdog2")
    sim.world.start()
    await sim.clock.advance(30.0)  # longer than a fix takes under the open sky
    assert sim.robot[Gps].reading.fix is GpsFix.NONE


@pytest.mark.slow  # minutes of robot time
async def test_motors_warm_up_with_the_load(dog):
    motors = dog.robot[Motors]
    assert len(motors.temperatures) == 12
    assert set(motors.temperatures.values()) == {25.0}
    dog.robot[Legs].perform(Motion.DANCE_1)
    await dog.clock.advance(100.0)
    warm = motors.temperatures
    assert all(28.0 < celsius < 60.0 for celsius in warm.values())
    assert len(set(warm.values())) > 6  # every motor differs
    await dog.clock.advance(25.0)
    await dog.clock.advance(100.0)
    assert all(motors.temperatures[name] < warm[name] for name in warm)


async def test_a_hot_motor_is_a_fault(dog):
    dog.robot[Motors].warm(90.0)
    await dog.clock.advance(0.5)
    assert "motor hot" in [fault.name for fault in dog.robot[Health].faults]


async def test_wire_and_wireless_charging(dog):
    battery, events = dog.robot[Battery], dog.robot.events.subscribe(BatteryChanged)
    battery.set_charge(0.5)
    await dog.clock.advance(1.0)
    assert (battery.state.charging, battery.state.supply) == (False, Supply.NONE)
    dog.world.stage.plug_in("a")
    await dog.clock.advance(1.0)
    assert (battery.state.charging, battery.state.supply) == (True, Supply.WIRE)
    assert any(event.charging for event in events.drain())
    with pytest.raises(Refused):
        dog.robot[Base].set_velocity(Twist(0.1))
    dog.world.stage.plug_in("a", wire=False)
    dog.robot[Base].set_velocity(Twist(0.1))
    dog.world.stage.place("a", Pose(0.12 + 0.25 + 0.005, 5.0))
    dog.robot[Base].set_velocity(Twist())
    await dog.clock.advance(1.0)
    assert (battery.state.charging, battery.state.supply) == (True, Supply.WIRELESS)


async def test_lights_fill_bounce_and_change_colour(dog):
    light, red = dog.robot[Light], Colour(200, 0, 0)
    assert light.zones == {"head": 8, "tail": 8, "eyes": 12}
    light.shine("head", red, LightEffect.FILLING, frequency=1.0)
    light.shine("tail", red, LightEffect.BOUNCING, frequency=1.0)
    light.shine("eyes", red, LightEffect.RAINBOW, frequency=1.0)
    shining, places, hues = [], [], []
    for _ in range(8):
        shining.append(sum(lamp == red for lamp in light.lamps("head")))
        places.append([lamp == red for lamp in light.lamps("tail")].index(True))
        hues.append(light.lamps("eyes")[0])
        await dog.clock.advance(0.125)
    assert shining == list(range(1, 9))
    assert places == [0, 2, 4, 5, 7, 5, 4, 2]
    assert hues[0] == red
    assert hues[4] == Colour(0, 200, 200)  # half round the wheel
