"""Components of a Slamware robot other than wheels and lidar, through a driver: one behind its REST door."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.clients.errors import BadAnswer
from roboglot.clients.slamware import SlamwareClient
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.interaction.light import Colour, Light, LightEffect
from roboglot.model.components.logistics.cargo import Cargo, DoorState, Stock
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.components.system.network import Network, NetworkMode, Uplink
from roboglot.model.errors import Blocked, InvalidGoal, NotFound, Refused
from roboglot.model.events import BoxChanged, EmergencyStopChanged
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.components.logistics.cargo import SimulatedCargo
from roboglot.simulation.components.logistics.jack import SimulatedJack
from roboglot.simulation.components.motion.emergency_stop import SimulatedEmergencyStop
from roboglot.testing import Forward
from tests.drivers.clients import Drive, OpenRest, Until
from tests.narrowing import of_kind

pytestmark = pytest.mark.world("empty", body="hermes")


async def ended(action: Action, until: Until) -> ActionStatus:
    await until(lambda: action.status.ended)
    return action.status


@pytest.mark.slow
async def test_boxes_open_close_and_report_their_contents(driven: Robot, robot: Robot, until: Until) -> None:
    far, near = robot[Cargo], driven[Cargo]
    assert isinstance(far, SimulatedCargo)
    assert near.compartments == far.compartments
    heard: list[BoxChanged] = []
    driven.events.listen(BoxChanged, heard.append)
    assert await ended(near.open_box(1, source="test"), until) is ActionStatus.SUCCEEDED
    assert far.box(1).door is DoorState.OPEN
    far.put(1, 0.5)
    await until(lambda: near.box(1).stock is Stock.PARTLY, patience=2)
    assert heard[-1].box == far.box(1)
    far.hold_hand_into(1, True)
    stalled = near.close_box(1, source="test")
    assert await ended(stalled, until) is ActionStatus.ABORTED
    assert isinstance(stalled.error, Blocked)
    far.hold_hand_into(1, False)
    assert await ended(near.close_box(1, source="test"), until) is ActionStatus.SUCCEEDED
    assert near.box(1) == far.box(1)
    assert near.box(1).locked
    with pytest.raises(NotFound):
        near.open_box(99)


async def test_the_jack_lifts_stops_and_fails(driven: Robot, robot: Robot, until: Until) -> None:
    far, near = robot[Jack], driven[Jack]
    assert isinstance(far, SimulatedJack)
    lifting = near.raise_platform(source="test")
    await until(lambda: 0.2 < far.position / far.stroke < 0.8)
    lifting.cancel()
    assert await ended(lifting, until) is ActionStatus.CANCELED
    assert far.stage is JackStage.STOPPED
    await until(lambda: near.stage is JackStage.STOPPED, patience=1)
    assert near.position / near.stroke == pytest.approx(far.position / far.stroke, abs=0.01)
    assert await ended(near.raise_platform(source="test"), until) is ActionStatus.SUCCEEDED
    assert (far.stage, near.stage) == (JackStage.UP, JackStage.UP)
    far.jammed = True
    jammed = near.lower_platform(source="test")
    assert await ended(jammed, until) is ActionStatus.ABORTED
    assert isinstance(jammed.error, Blocked)
    with pytest.raises(Refused):
        near.lower_platform()
    with pytest.raises(Refused):
        _ = near.loaded
    far.jammed = False
    near.clear_alarm()
    await until(lambda: not near.alarm, patience=2)
    assert not far.alarm


async def test_strips_shine_in_the_robots_modes(driven: Robot, robot: Robot, forward: Forward) -> None:
    far, near = robot[Light], driven[Light]
    assert set(near.zones) == {"left", "right", "left_lower", "right_lower"}
    near.shine("left", Colour(10, 200, 30))
    near.shine("right_lower", Colour(0, 0, 200), LightEffect.FLASH, frequency=1.0)
    await forward(seconds=0.1)
    assert set(far.lamps("left")) == {Colour(10, 200, 30)}
    seen = set()
    for _ in range(12):
        await forward(seconds=0.1)
        seen |= set(far.lamps("right_lower"))
    assert seen == {Colour(0, 0, 200), Colour()}
    near.shine("left", effect=LightEffect.OFF)
    await forward(seconds=0.1)
    assert set(far.lamps("left")) == {Colour()}
    near.shine("left_lower", Colour(90, 90, 90), LightEffect.BREATH, frequency=0.5)
    shades = set()
    for _ in range(20):
        await forward(seconds=0.1)
        shades.add(far.lamps("left_lower")[0].red)
    assert max(shades) > 70
    assert min(shades) < 20
    with pytest.raises(InvalidGoal):
        near.shine("left", effect=LightEffect.RAINBOW)
    with pytest.raises(InvalidGoal):
        near.shine("left", lamp=1)


async def test_emergency_stop_holds_and_reaches_every_door(
    driven: Robot, robot: Robot, rest: OpenRest, until: Until, forward: Forward
) -> None:
    dashboard, changes = await rest(driven), list[bool]()
    driven.events.listen(EmergencyStopChanged, lambda event: changes.append(event.engaged))
    going = driven[Driving].drive(Twist(x=0.3), source="test")
    await forward(seconds=1)
    driven[EmergencyStop].engage()
    await until(lambda: driven[EmergencyStop].engaged, patience=1)
    assert robot[EmergencyStop].engaged
    await until(lambda: going.status.ended, patience=4)
    assert (await dashboard.get_robot_health()).has_system_emergency_stop
    await until(lambda: driven[Health].has("emergency stop"), patience=2)
    driven[EmergencyStop].release()
    await until(lambda: not driven[EmergencyStop].engaged, patience=1)
    assert not robot[EmergencyStop].engaged
    assert changes == [True, False]
    await until(lambda: not driven[Health].faults, patience=2)
    driven[EmergencyStop].release_brake(True)
    await until(lambda: driven[EmergencyStop].brake_released, patience=1)
    assert robot[EmergencyStop].brake_released
    of_kind(robot[EmergencyStop], SimulatedEmergencyStop).press(True)  # by hand: the driver hears of it all the same
    await until(lambda: driven[EmergencyStop].engaged, patience=1)


@pytest.mark.slow
async def test_it_sleeps_and_wakes(driven: Robot, robot: Robot, until: Until) -> None:
    assert await ended(driven[Power].sleep(source="test"), until) is ActionStatus.SUCCEEDED
    assert (robot[Power].mode, driven[Power].mode) == (PowerMode.ASLEEP, PowerMode.ASLEEP)
    assert await ended(driven[Power].wake(source="test"), until) is ActionStatus.SUCCEEDED
    assert robot[Power].mode is PowerMode.AWAKE
    with pytest.raises(Refused):
        driven[Power].save()


@pytest.mark.slow
@pytest.mark.world("office", body="hermes")
async def test_its_network_is_reported_and_set(driven: Robot, robot: Robot, until: Until) -> None:
    near, far = driven[Network], robot[Network]
    assert (near.state.ssid, near.state.mac, near.state.address) == (far.state.ssid, far.state.mac, far.state.address)
    assert near.signal == pytest.approx(max(min(far.signal, -50.0), -100.0), abs=1)
    setting = asyncio.ensure_future(near.be_access_point("mine", "12345678"))
    await until(setting.done)
    await setting
    assert far.state.mode is NetworkMode.ACCESS_POINT
    await until(lambda: (near.state.mode, near.state.ssid) == (NetworkMode.ACCESS_POINT, "mine"), patience=6)
    setting = asyncio.ensure_future(near.set_priority(Uplink.MOBILE))
    await until(setting.done)
    assert (far.priority, near.priority) == (Uplink.MOBILE, Uplink.MOBILE)
    with pytest.raises(InvalidGoal):
        near.join("")


@pytest.mark.world("empty", body="cyberdog2")
async def test_missing_components_are_not_announced(driven: Robot) -> None:
    for part in (Jack, Cargo, EmergencyStop, Light):
        assert part not in driven


async def test_senseless_answer_costs_only_its_part(
    slamware_door: SlamwareDoor, drive: Drive, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def nonsense(_: SlamwareClient) -> None:
        raise BadAnswer("boxes of another world")

    monkeypatch.setattr(SlamwareClient, "get_cargos", nonsense)
    await forward(seconds=1)
    driven = await drive(f"slamware://127.0.0.1:{slamware_door.port}")
    assert driven[Link].state is LinkState.UP
    assert Cargo not in driven
    assert Jack in driven
