"""A request to a real robot is answered when the robot has answered: its refusals reach the client."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from roboglot.clients.slamware import SlamwareRefused
from roboglot.confirmation import Confirmation, confirm, confirmed
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.interaction.armor import Armor
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.input_device import InputDevice
from roboglot.model.components.interaction.light import Colour, Light
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.pwm import PwmPorts
from roboglot.model.errors import Refused, RobotError
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.motion import Result
from roboglot.wire.slamware.chapters.slam.localization import NewOrigin
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap
from roboglot.wire.slamware.geometry import Point, Pose3D
from tests.drivers.bad_link import Connect
from tests.drivers.clients import Open, OpenRest
from tests.drivers.rig import Rig


def refuse(*_: object, **__: object) -> None:
    """Refuse, in place of a method of the real robot."""
    raise Refused("not now")


@pytest.mark.world("empty", body="hermes")
async def test_pose_is_set_or_refused_when_answered(
    driven: Robot, robot: Robot, rest: OpenRest, monkeypatch: pytest.MonkeyPatch
) -> None:
    front = await rest(driven)
    await front.set_pose(Pose3D(1.0, 0.5, 0.0, 0.0))
    assert robot[Localization].pose.x == pytest.approx(1.0, abs=0.01)
    monkeypatch.setattr(robot[Localization], "set_pose", refuse)
    with pytest.raises(SlamwareRefused, match="not now"):
        await front.set_pose(Pose3D(2.0, 0.5, 0.0, 0.0))
    assert robot[Localization].pose.x == pytest.approx(1.0, abs=0.01)


@pytest.mark.world("empty", body="hermes")
async def test_refused_pose_ends_the_action_for_it(
    driven: Robot, robot: Robot, rest: OpenRest, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The action had succeeded, for it did not wait for the robot's answer."""
    front = await rest(driven)
    assert driven[DockContact].docked
    driven[Docking].set_home(driven[Localization].pose)
    monkeypatch.setattr(robot[Localization], "set_pose", refuse)
    action = await front.begin("ManualRelocalizationAction", None)
    await forward(seconds=1)
    state = await action.look()
    assert (state.result, state.reason) == (Result.FAILED, "operation fail: not now")


@pytest.mark.world("empty", body="hermes")
@pytest.mark.parametrize("change", ["clear", "move_origin", "load"])
async def test_drawings_stay_where_map_is_kept(
    driven: Robot, robot: Robot, rest: OpenRest, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    front = await rest(driven)
    await front.set_pose(Pose3D(1.0, 0.5, 0.0, 0.0))
    await driven[Places].put(PointOfInterest("gate", Pose(2.0, 1.0, 0.0), {}))
    whole = await front.get_composite_map()
    monkeypatch.setattr(robot[Mapping], change, refuse)
    before = driven[Places].all()
    requests = {
        "clear": front.clear_map,
        "move_origin": lambda: front.move_origin_point(NewOrigin(Point(1.0, 0.5))),
        "load": lambda: front.set_composite_map(CompositeMap(whole.layers[:1])),
    }
    with pytest.raises(SlamwareRefused, match="not now"):
        await requests[change]()
    assert driven[Places].all() == before
    assert [place.pose.x for place in before] == [2.0]


@pytest.mark.world("empty", body="robomaster_ep")
async def test_refused_mode_fails_also_when_repeated(
    driven_ep: Robot, robot: Robot, text_door: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = await text_door(driven_ep)
    assert await client.ask("robot mode gimbal_lead;") == "ok"
    assert robot[Gimbal].mode is FollowMode.GIMBAL_LEAD
    monkeypatch.setattr(robot[Gimbal], "set_mode", refuse)
    for _ in range(3):  # repeated lines may take a shorter way
        assert await client.ask("robot mode free;") == "fail"
        assert await client.ask("robot mode ?;") == "gimbal_lead"


@pytest.mark.world("empty", body="robomaster_ep")
@pytest.mark.parametrize("line", ["AI push marker on", "sound event applause on", "game_msg on"])
async def test_refused_pushes_are_refused_again(
    driven_ep: Robot, robot: Robot, text_door: Open, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    """The second time, the answer was "ok", as if they were on already."""
    client = await text_door(driven_ep)
    with monkeypatch.context() as busy:
        busy.setattr(robot[Vision].markers, "subscribe", refuse)
        busy.setattr(robot[Hearing], "claps", refuse)
        busy.setattr(robot[InputDevice], "listen", refuse)
        for _ in range(3):
            assert await client.ask(f"{line};") == "fail"
    assert await client.ask(f"{line};") == "ok"


@pytest.mark.world("empty", body="hermes")
@pytest.mark.parametrize("back", ["slamware"])
async def test_silent_robot_confirms_nothing(way: Rig, robot: Robot, connect: Connect, rest: OpenRest) -> None:
    async with connect() as driven:
        front = await rest(driven)
        way.fault.silent = True
        begun = driven.clock.time()
        with pytest.raises(SlamwareRefused):
            await front.set_pose(Pose3D(1.0, 0.5, 0.0, 0.0))
        assert driven.clock.time() - begun < 2.0
        assert robot[Localization].pose.x == pytest.approx(0.0, abs=0.1)


@pytest.mark.world("empty", body="robomaster_ep")
async def test_refused_light_stays_as_it_was(
    driven_ep: Robot, robot: Robot, text_door: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    client, light = await text_door(driven_ep), driven_ep[Light]
    assert await client.ask("led control comp all r 9 g 0 b 0 effect solid;") == "ok"
    before = {zone: light.lamps(zone) for zone in light.zones}
    monkeypatch.setattr(robot[Light], "shine", refuse)
    assert await client.ask("led control comp all r 0 g 9 b 0 effect solid;") == "fail"
    assert {zone: light.lamps(zone) for zone in light.zones} == before


SETTINGS: dict[str, Callable[[Robot, int], object]] = {
    "shine": lambda robot, number: robot[Light].shine("front", Colour(9 + number, 0, 0)),
    "set_mode": lambda robot, number: robot[Gimbal].set_mode([FollowMode.FREE, FollowMode.GIMBAL_LEAD][number]),
    "set_sensitivity": lambda robot, number: robot[Armor].set_sensitivity(7 + number),
    "set_beads": lambda robot, number: robot[Blaster].set_beads(3 + number),
    "set_duty": lambda robot, number: robot[PwmPorts].set_duty(1, 0.3 + number / 10),
}


def shown(robot: Robot) -> tuple[object, ...]:
    light, gimbal, pwm = robot[Light], robot[Gimbal], robot[PwmPorts]
    return light.lamps("front"), gimbal.mode, robot[Armor].sensitivity, robot[Blaster].beads, pwm.signal(1).duty


@pytest.mark.world("empty", body="robomaster_ep")
@pytest.mark.parametrize("method", SETTINGS)
async def test_two_refused_settings_leave_the_first(
    driven_ep: Robot, robot: Robot, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    before = shown(driven_ep)
    for part in (Light, Gimbal, Armor, Blaster, PwmPorts):
        if hasattr(part, method):
            monkeypatch.setattr(robot[part], method, refuse)

    async def set_twice() -> None:
        async with confirmed():
            SETTINGS[method](driven_ep, 0)
            SETTINGS[method](driven_ep, 1)
            assert shown(driven_ep) != before

    with pytest.raises(RobotError):
        await set_twice()
    assert shown(driven_ep) == before


async def test_commands_of_other_tasks_are_not_awaited() -> None:
    async def refused() -> Exception:
        return Refused("not now")

    async def action() -> None:
        confirm(asyncio.ensure_future(refused()))

    with Confirmation() as confirmation:
        begun = asyncio.create_task(action())
        await begun
    await confirmation.wait()
    with Confirmation() as confirmation:
        confirm(asyncio.ensure_future(refused()))
    with pytest.raises(Refused, match="not now"):
        await confirmation.wait()
