"""Pushes of the robot through the client: readings, events, pictures, sound, its announced address."""

import asyncio
import contextlib
from functools import partial

import av
import pytest

from roboglot.clients.errors import LinkLost
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.clients.robomaster.datagrams import PushPort, discover
from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.model.components.interaction.input_device import InputDevice, MouseButton
from roboglot.testing.addresses import free_port
from roboglot.wire.robomaster.telemetry import (
    AdapterLevel,
    ArmorHit,
    ChassisAttitude,
    ChassisPosition,
    ChassisStatus,
    GameInput,
    GimbalAttitude,
    LinesSeen,
    TargetsSeen,
)
from tests.drivers.settling import settle
from tests.narrowing import of_kind

ADDRESS = "127.0.0.9"
BUILDS = pytest.mark.parametrize("profile", ["spec", "fw60", "fw70"], indirect=True)
pytestmark = pytest.mark.world("office", body="robomaster_ep")


@BUILDS
async def test_pushes_of_every_kind(client, run, forward, robot) -> None:
    heard: list[object] = []
    with client.watch() as everything:
        await run(client.chassis.push(position=True, attitude=True, status=True, freq=10))
        await run(client.gimbal.push(True, afreq=10))
        await run(client.ai.push(marker=True, line=True))
        await run(client.game_msg.on())
        everything.drain()
        stop = client.listen(heard.append, ChassisStatus)
        robot[InputDevice].press("w")
        robot[InputDevice].click(MouseButton.LEFT)
        for _ in range(20):
            await forward(seconds=0.05)
            await settle()
        reported = everything.drain()
        stop()
    kinds = [type(each) for each in reported]
    assert {ChassisPosition, ChassisAttitude, ChassisStatus, GimbalAttitude, GameInput, TargetsSeen, LinesSeen} == set(
        kinds
    )
    assert kinds.count(ChassisPosition) == pytest.approx(10, abs=1)
    assert heard == [each for each in reported if isinstance(each, ChassisStatus)]
    assert of_kind(heard[-1], ChassisStatus).static
    assert next(each for each in reversed(reported) if isinstance(each, GameInput)).data[0] == 2
    assert {each.kind for each in reported if isinstance(each, TargetsSeen)} == {"marker"}


@BUILDS
async def test_events(client, run, forward, robot, world) -> None:
    with client.watch(ArmorHit, AdapterLevel) as events:
        await run(client.armor.event(True))
        await run(client.sensor_adapter.event(True))
        world.stage.touch_plate("a", PlatePlace.REAR)
        await forward(seconds=0.2)
        assert await asyncio.wait_for(anext(events), 60) == ArmorHit(1, 2)
        world.stage.apply_voltage("a", 3, 2, 2.5)
        await forward(seconds=0.2)
        assert await asyncio.wait_for(anext(events), 60) == AdapterLevel(3, 2, 1)


async def test_events_of_robot_whose_address_was_found_later(client, run, forward, robot, world) -> None:
    late = RoboMasterClient("discover", clock=robot.clock, ports=client._ports, local="127.0.0.1")
    late.host = client.host
    async with late:
        with late.watch(ArmorHit) as events:
            await run(late.armor.event(True))
            world.stage.touch_plate("a", PlatePlace.REAR)
            await forward(seconds=0.2)
            assert await asyncio.wait_for(anext(events), 60) == ArmorHit(1, 2)


async def test_watching_ends_with_the_client(client) -> None:
    watched = client.watch()
    await client.close()
    with pytest.raises(StopAsyncIteration):
        await anext(watched)


async def test_two_robots_share_push_port_and_are_distinguished() -> None:
    """Robots are told apart by the sender's address of a datagram."""
    import socket

    number = free_port()
    port, heard = PushPort("127.0.0.1", number), list[tuple[int, bytes]]()

    def note(n: int, data: bytes) -> None:
        heard.append((n, data))

    stops = [port.attach(f"127.0.0.{n}", partial(note, n)) for n in (31, 32)]
    with contextlib.ExitStack() as stack:
        for n in (31, 32, 33):
            robot = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            robot.bind((f"127.0.0.{n}", 0))
            robot.sendto(b"x%d" % n, ("127.0.0.1", number))
        await asyncio.sleep(0.02)
        assert heard == [(31, b"x31"), (32, b"x32")]
        with pytest.raises(LinkLost, match="share one PushPort"):
            PushPort("127.0.0.1", number).attach("127.0.0.31", partial(note, 31))
    for stop in stops:
        stop()
    PushPort("127.0.0.1", number).attach("127.0.0.31", partial(note, 31))()


@pytest.mark.slow
async def test_pictures(client, run, robot) -> None:
    await run(client.stream.on())
    units = client.video()
    got = [await run(anext(units)) for _ in range(40)]
    assert [unit.keyframe for unit in got[:2]] == [True, False]
    assert sum(unit.keyframe for unit in got) == 2, "one a second"
    decoder = av.CodecContext.create("h264", "r")
    pictures = [picture for unit in got for picture in decoder.decode(av.Packet(unit.data))]
    assert len(pictures) >= 38
    assert {(picture.width, picture.height) for picture in pictures} == {(1280, 720)}
    await units.aclose()


async def test_sound(client, run, forward) -> None:
    await run(client.audio.on())
    packets = client.sounds()
    first = asyncio.ensure_future(anext(packets))
    await run(asyncio.sleep(0.03))
    await forward(seconds=1)
    got = [await first, *[await asyncio.wait_for(anext(packets), 60) for _ in range(20)]]
    decoder = av.CodecContext.create("opus", "r")
    assert {len(packet) for packet in got} == {len(got[0])}, "not glued together"
    sounds = [sound for packet in got for sound in decoder.decode(av.Packet(packet))]
    assert {sound.samples for sound in sounds[1:]} == {960}
    await packets.aclose()


@pytest.mark.slow
async def test_a_robot_that_no_one_holds_is_found(door, robot, run) -> None:
    port = door._config.broadcast_port
    assert await run(discover(30, first=True, clock=robot.clock, port=port)) == [ADDRESS]
    assert await run(discover(3, clock=robot.clock, port=port)) == [ADDRESS]
    assert await run(discover(3, clock=robot.clock, port=port, passing_over={ADDRESS})) == []


async def test_a_robot_that_is_held_is_not(client, door, robot, run) -> None:
    assert await run(discover(5, clock=robot.clock, port=door._config.broadcast_port)) == []


def test_no_address_is_needed_to_make_one() -> None:
    assert RoboMasterClient("robot.example").state == "closed"
