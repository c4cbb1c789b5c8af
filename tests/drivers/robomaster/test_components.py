"""Components of an EP through a driver: a simulated EP behind its door in two builds, the text protocol in front."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path

import pytest

from roboglot.media.video import VideoStream
from roboglot.model.components.interaction.armor import Armor, HitKind, PlatePlace
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.light import Colour, Light, LightEffect
from roboglot.model.components.motion.arm import Arm, ArmPosition
from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper, GripperStatus
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.events import ArmorHit
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from roboglot.simulation.components.interaction.armor import SimulatedArmor
from roboglot.simulation.components.sensing.camera import SimulatedCamera
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.drivers.clients import Open, Script
from tests.drivers.rig import cut_session
from tests.narrowing import of_kind

pytestmark = pytest.mark.world("empty", body="robomaster_ep")


@pytest.fixture(params=["spec", pytest.param("fw70", marks=pytest.mark.slow)])
def profile(request: pytest.FixtureRequest) -> str:
    """Both profiles: the manual's, and robots', of which test_senses.py has more."""
    return str(request.param)


@pytest.fixture
async def script(driven_ep: Robot, text_door: Open, forward: Forward) -> Script:
    """A text client of the driven robot; its door speaks as the manual does."""
    return Script(await text_door(driven_ep), forward)


async def test_the_arm_goes_where_it_should(script: Script, robot: Robot, driven_ep: Robot) -> None:
    assert await script.done("robotic_arm moveto x 5 y 3 wait_for_complete true;") == "ok"
    real, home = robot[Arm].position, robot[Arm].home
    assert (real.x - home.x, real.z - home.z) == pytest.approx((0.05, 0.03), abs=0.002)
    reported = await script.client.numbers("robotic_arm position ?;")
    assert reported == pytest.approx([5.0, 3.0], abs=0.25)
    assert await script.done("robotic_arm move x -2 y 1 wait_for_complete true;") == "ok"
    assert robot[Arm].position.z - home.z == pytest.approx(0.04, abs=0.003)
    assert await script.client.ask("robotic_arm move x 50 y 0;") == "fail"
    assert await script.done("robotic_arm recenter wait_for_complete true;") == "ok"
    assert robot[Arm].position.x == pytest.approx(home.x, abs=0.002)
    moving = driven_ep[Arm].move_to(ArmPosition(0.2, 0.1), source="test")
    await script.forward(seconds=0.4)
    driven_ep[Arm].stop()
    await script.forward(seconds=0.3)
    assert moving.status.name == "CANCELED"
    where = robot[Arm].position
    await script.forward(seconds=0.5)
    assert robot[Arm].position == where


async def test_the_gripper_opens_and_closes(script: Script, robot: Robot, driven_ep: Robot) -> None:
    closing = driven_ep[Gripper].close(4, source="test")
    await script.forward(seconds=0.3)
    assert await script.client.ask("robotic_gripper status ?;") == "1"
    await script.forward(seconds=1)
    assert closing.status.name == "SUCCEEDED"
    assert await script.client.ask("robotic_gripper status ?;") == "0"
    assert robot[Gripper].status is GripperStatus.CLOSED
    opening = driven_ep[Gripper].open(2, source="test")
    await script.forward(seconds=2)
    assert opening.status.name == "SUCCEEDED"
    assert (driven_ep[Gripper].status, driven_ep[Gripper].opening) == (GripperStatus.OPEN, 0.10)
    with pytest.raises(InvalidGoal):
        driven_ep[Gripper].open(5)


async def test_servos_turn(script: Script, robot: Robot, driven_ep: Robot) -> None:
    assert driven_ep[Servos].count == robot[Servos].count
    assert await script.done("servo angle id 2 angle -40 wait_for_complete true;") == "ok"
    assert robot[Servos].angle(2) == pytest.approx(math.radians(-40), abs=0.02)
    assert await script.client.numbers("servo angle id 2 ?;") == pytest.approx([-40.0], abs=1)
    assert await script.client.ask("servo speed id 1 speed 90;") == "ok"
    await script.forward(seconds=1)
    assert robot[Servos].angle(1) == pytest.approx(math.pi / 2, abs=0.3)
    assert await script.client.ask("servo stop;") == "ok"
    await script.forward(seconds=0.3)
    still = robot[Servos].angle(1)
    await script.forward(seconds=0.5)
    assert robot[Servos].angle(1) == still
    with pytest.raises(NotFound):
        driven_ep[Servos].angle(4)
    with pytest.raises(Refused, match="speed of its servos"):  # it was ignored
        driven_ep[Servos].move_to(1, 0.5, speed=0.1)


async def test_the_blaster_fires_as_many_as_asked(script: Script, robot: Robot, driven_ep: Robot) -> None:
    before = robot[Blaster].ammo
    assert await script.client.ask("blaster bead 3;") == "ok"
    assert await script.client.ask("blaster bead ?;") == "3"
    assert await script.client.ask("blaster fire;") == "ok"
    assert await script.client.ask("blaster fire;") == "fail"
    await script.forward(seconds=1)
    assert robot[Blaster].beads == 3
    assert robot[Blaster].ammo == before - 3
    with pytest.raises(Refused):
        _ = driven_ep[Blaster].ammo


async def test_a_hit_is_reported_to_every_door(script: Script, robot: Robot, driven_ep: Robot, world: World) -> None:
    heard: list[ArmorHit] = []
    driven_ep.events.listen(ArmorHit, heard.append)
    assert await script.client.ask("armor sensitivity 8;") == "ok"
    await script.forward(seconds=0.2)
    assert robot[Armor].sensitivity == 8
    assert driven_ep[Armor].plates == tuple(sorted(robot[Armor].plates, key=driven_ep[Armor].plates.index))
    of_kind(robot[Armor], SimulatedArmor).touch(PlatePlace.GIMBAL_LEFT)
    await script.forward(seconds=0.3)
    assert [(hit.place, hit.kind) for hit in heard] == [(PlatePlace.GIMBAL_LEFT, HitKind.HAND)]


async def test_commands_after_a_setting_see_it(script: Script, robot: Robot) -> None:
    """A script does not wait until the robot has confirmed its mode."""
    script.client.writer.write(b"robot mode free;gimbal suspend;gimbal resume;gimbal move y 20;")
    await asyncio.sleep(0.05)
    await script.forward(seconds=2)
    async with asyncio.timeout(60):
        assert [await script.client.reader.readuntil(b";") for _ in range(4)] == [b"ok;"] * 4
    assert math.degrees(robot[Gimbal].angles.yaw) == pytest.approx(-20, abs=2)


async def test_a_session_ends_whole_without_its_robot(script: Script, driven_ep: Robot) -> None:
    for text in ("blaster bead 3;", "gimbal suspend;", "chassis push position on;", "ir_distance_sensor measure on;"):
        assert await script.client.ask(text) == "ok"
    cut_session(driven_ep[Base])
    await script.forward(seconds=0.1)
    assert driven_ep[Link].state is LinkState.LOST
    assert await script.client.ask("quit;") == "ok"
    assert await script.client.ask("command;") == "fail"
    assert await script.client.ask("robot battery ?;") == "not in sdk mode"
    await script.forward(seconds=2)
    assert await script.client.ask("command;") == "ok"
    assert await script.client.ask("blaster bead ?;") == "1"


async def test_distances_come_in_metres(script: Script, robot: Robot, driven_ep: Robot) -> None:
    sensors = driven_ep[RangeSensors]
    assert sensors.reading("ir_1") is None
    assert await script.client.ask("ir_distance_sensor measure on;") == "ok"
    await script.forward(seconds=0.5)
    for name in sensors.names:
        reported, real = sensors.reading(name), robot[RangeSensors].reading(name)
        assert reported is not None
        assert real is not None
        assert reported.distance == pytest.approx(real.distance, rel=0.1)
    assert await script.client.ask("ir_distance_sensor measure off;") == "ok"
    await script.forward(seconds=0.3)
    assert (robot[RangeSensors].measuring, sensors.reading("ir_1")) == (False, None)


async def test_lamps_shine_through(script: Script, robot: Robot, driven_ep: Robot) -> None:
    assert await script.client.ask("led control comp bottom_left r 10 g 20 b 30 effect blink blink_freq 4;") == "ok"
    assert await script.client.ask("led control comp top_all r 255 g 0 b 9 effect scrolling;") == "ok"
    assert await script.client.ask("led control comp top_right r 1 g 2 b 3 effect solid single_led_index 3;") == "ok"
    await script.forward(seconds=0.2)
    left, ring = robot[Light].state("left"), robot[Light].state("gimbal_left")
    assert (left.colour, left.effect, left.frequency) == (Colour(10, 20, 30), LightEffect.FLASH, 4.0)
    assert (ring.colour, ring.effect) == (Colour(255, 0, 9), LightEffect.SCROLLING)
    assert robot[Light].lamps("gimbal_right")[2] == driven_ep[Light].lamps("gimbal_right")[2] == Colour(1, 2, 3)
    with pytest.raises(InvalidGoal):
        driven_ep[Light].shine("front", effect=LightEffect.RAINBOW)


async def test_lamps_shine_again_after_a_lost_link(driven_ep: Robot, robot: Robot, forward: Forward) -> None:
    driven_ep[Light].shine("rear", Colour(7, 8, 9))
    await forward(seconds=0.2)
    robot[Light].shine("rear", Colour())  # another client
    cut_session(driven_ep[Base])
    await forward(seconds=2)
    assert driven_ep[Link].state is LinkState.UP
    assert robot[Light].state("rear").colour == Colour(7, 8, 9)


async def test_single_wheels_are_those_of_the_build(driven_ep: Robot, robot: Robot, forward: Forward) -> None:
    driven_ep[Driving].drive(WheelSpeeds(front_left=8, front_right=4, rear_left=-2, rear_right=2), source="test")
    await forward(seconds=1)
    reported, real = driven_ep[Base].wheel_speeds, robot[Base].wheel_speeds
    for corner in ("front_left", "front_right", "rear_left", "rear_right"):
        assert getattr(reported, corner) == pytest.approx(getattr(real, corner), abs=0.3)
    assert real.front_left > real.rear_left + 3


@pytest.mark.parametrize("profile", ["spec"])
async def test_pictures_come_through(driven_ep: Robot, robot: Robot, forward: Forward) -> None:
    camera = driven_ep[Camera]
    driven_ep[Gimbal].move_to(pitch=0.2, source="test")
    with camera.subscribe() as pictures:
        for _ in range(12):
            await forward(seconds=0.1)
            if shown := pictures.drain():
                break
        else:
            pytest.fail("no picture within 1.2 s")
    frame, real = shown[-1], await robot[Camera].capture()
    assert (frame.width, frame.height) == (real.width, real.height)
    assert abs(frame.luma.astype(int) - real.luma).mean() < 12
    await forward(seconds=0.2)
    simulated = robot[Camera]
    assert isinstance(simulated, SimulatedCamera)
    assert not simulated._feed.viewers  # no one looks: the robot films no more
    camera.set_exposure(-0.8)
    await forward(seconds=0.1)
    assert (camera.exposure, robot[Camera].exposure) == (-1.0, -1.0)


@pytest.mark.parametrize("profile", ["spec"])
async def test_dogs_door_takes_photos_and_films_with_it(driven_ep: Robot, forward: Forward, tmp_path: Path) -> None:
    files = CameraFiles(driven_ep, tmp_path)
    taking = asyncio.ensure_future(files.photograph())
    for _ in range(40):
        await forward(seconds=0.1)
        if taking.done():
            break
    photo = await taking
    assert photo.read_bytes().startswith(b"\xff\xd8")
    files.record()
    await forward(seconds=2)
    film = await files.stop()
    assert b"ftyp" in film.read_bytes()[:16]
    assert CameraFiles(driven_ep, tmp_path).names() == sorted([photo.name, film.name])
    files.remove(photo)
    assert files.names() == [film.name]


@pytest.mark.parametrize("profile", ["spec"])
async def test_the_robots_own_packets_reach_the_next_door(driven_ep: Robot, forward: Forward) -> None:
    video = driven_ep[VideoStream]
    with video.subscribe() as first, video.subscribe() as second:
        packets, others = first.drain(), second.drain()
        for _ in range(40):
            await forward(seconds=0.1)
            packets, others = packets + first.drain(), others + second.drain()
            if len(packets) >= 5:
                break
    assert packets == others
    assert packets[0].keyframe
    assert packets[0].data.startswith(b"\x00\x00\x00\x01\x09")  # a delimiter: the EP's door begins pictures with it
    assert not packets[1].keyframe


@pytest.mark.world("empty", body="cyberdog2")
@pytest.mark.parametrize("profile", ["spec"])
async def test_missing_components_are_not_announced(driven_ep: Robot) -> None:
    for part in (Arm, Gripper, Servos, Blaster, Armor, Gimbal, Light):
        assert part not in driven_ep
    assert Camera in driven_ep
    assert driven_ep[RangeSensors].names == ("ir_1",)
