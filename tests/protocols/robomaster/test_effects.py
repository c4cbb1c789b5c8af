"""Effects of the chapters beyond the chassis on the robot and its world, and their reports."""

import asyncio
import math

import pytest

from roboglot.model.components.interaction.armor import Armor, PlatePlace
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.input_device import InputDevice, MouseButton
from roboglot.model.components.interaction.light import DARK, Colour, Light
from roboglot.model.components.motion.arm import Arm
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.system.pwm import PwmPorts
from roboglot.model.geometry import Point, Pose
from roboglot.model.sound import claps
from tests.drivers.settling import settle

OK, FAIL = "ok;", "fail;"
FW70 = pytest.mark.parametrize("door", [{"profile": "fw70"}], indirect=True)
pytestmark = pytest.mark.world("playground", body="robomaster_ep")


async def events_of(reader: asyncio.StreamReader) -> bytes:
    try:
        return await asyncio.wait_for(reader.read(4096), 0.1)
    except TimeoutError:
        return b""


async def test_gimbal_moves_and_answers_at_the_end(client, robot, forward) -> None:
    client.send("robot mode free;gimbal moveto p 20 y 60 vp 90 vy 90;")
    assert await client.reply() == OK
    waiting = asyncio.ensure_future(client.reply())
    await asyncio.sleep(0.05)
    await forward(seconds=0.3)
    await asyncio.sleep(0.02)
    assert not waiting.done()
    await forward(seconds=1)
    assert await waiting == OK
    angles = robot[Gimbal].angles
    assert (math.degrees(angles.pitch), math.degrees(angles.yaw)) == pytest.approx((-20, -60), abs=1)
    assert await client.numbers("gimbal attitude ?;") == pytest.approx([20, 60], abs=1)


async def test_gimbal_lead_turns_the_chassis(client, world, forward) -> None:
    assert await client.ask("robot mode gimbal_lead;") == OK
    before = world.truth.pose_of("a").yaw
    assert await client.ask("gimbal move y 40 vy 90 wait_for_complete false;") == OK
    await forward(seconds=3)
    assert math.degrees(world.truth.pose_of("a").yaw - before) == pytest.approx(-40, abs=3)


async def answered(client, forward, text: str, seconds: float = 20.0) -> str:
    """Return the answer to a command that takes robot time."""
    client.send(text)
    waiting = asyncio.ensure_future(client.reply())
    for _ in range(int(seconds / 0.25)):
        await settle()
        if waiting.done():
            break
        await forward(seconds=0.25)
    return str(await waiting)


async def test_gimbal_yaw_is_joints_however_far_chassis_turns(client, forward) -> None:
    assert await client.ask("robot mode free;") == OK
    assert await answered(client, forward, "chassis move z 720 vz 300 wait_for_complete true;") == OK
    assert await answered(client, forward, "gimbal recenter;") == OK
    assert await client.numbers("gimbal attitude ?;") == pytest.approx([0, 0], abs=0.5)
    assert await answered(client, forward, "gimbal moveto y 0;") == OK
    assert await answered(client, forward, "gimbal moveto y 250 vy 400;") == OK
    assert await client.numbers("gimbal attitude ?;") == pytest.approx([0, 250], abs=0.5)
    assert await answered(client, forward, "gimbal moveto y -170 vy 400;") == OK
    assert await client.numbers("gimbal attitude ?;") == pytest.approx([0, -170], abs=0.5)


async def test_the_end_of_travel_answers_the_same(client, forward) -> None:
    assert await client.ask("robot mode free;") == OK
    for text in ("gimbal moveto p -25 vp 200;", "gimbal recenter;gimbal move p -25 vp 200;"):
        if "recenter" in text:
            assert await answered(client, forward, "gimbal recenter;") == OK
            text = text.partition(";")[2]
        assert await answered(client, forward, text) == FAIL
        assert (await client.numbers("gimbal attitude ?;"))[0] == pytest.approx(-20, abs=0.5), (
            "it goes as far as it can"
        )
    assert await answered(client, forward, "gimbal moveto y 240 vy 400;") == OK
    assert await answered(client, forward, "gimbal move y 20 vy 200;") == FAIL
    assert (await client.numbers("gimbal attitude ?;"))[1] == pytest.approx(250, abs=0.5)


async def test_a_servo_at_minus_180_reads_minus_180(client, forward) -> None:
    for goal in (-180, 180, 0, -180, 90):
        assert await answered(client, forward, f"servo angle id 1 angle {goal} wait_for_complete true;") == OK
        assert await client.ask("servo angle id 1 ?;") == f"{goal}.0;"


async def test_chassis_lead_ignores_the_gimbals_yaw(client, robot, forward) -> None:
    assert await client.ask("gimbal speed p 20 y 90;") == OK
    await forward(seconds=0.5)
    assert math.degrees(robot[Gimbal].angles.yaw) == pytest.approx(0, abs=0.5)
    assert math.degrees(robot[Gimbal].angles.pitch) == pytest.approx(-10, abs=2)


async def test_a_sleeping_gimbal_takes_no_commands(client, robot) -> None:
    await client.ask("gimbal suspend;")
    assert await client.ask("gimbal speed p 5;") == FAIL
    await client.ask("gimbal resume;")
    assert await client.ask("gimbal speed p 5;") == OK


async def test_gimbal_pushes(client, pushes, forward) -> None:
    await client.ask("gimbal push attitude on afreq 20;")
    await forward(seconds=1.001)
    texts = pushes.texts()
    assert len(texts) == 20
    assert texts[0] == "gimbal push attitude 0.000 0.000;"


async def test_a_shot_fires_its_beads(client, robot, forward) -> None:
    ammo = robot[Blaster].ammo
    await client.ask("blaster bead 3;")
    assert await client.ask("blaster bead ?;") == "3;"
    assert await client.ask("blaster fire;") == OK
    assert await client.ask("blaster fire;") == FAIL, "one shot at a time"
    await forward(seconds=1)
    assert robot[Blaster].ammo == ammo - 3


@pytest.mark.world("empty", robots=("a", "b"), body="robomaster_ep")
async def test_beads_are_felt_by_robot_that_they_hit(client, robot, world, forward, listen) -> None:
    """a has the door; b shoots at its front."""
    here = world.truth.pose_of("a")
    world.stage.place("b", here.compose(Pose(1.5, 0.0, math.pi)))
    assert await client.ask("armor event hit on;") == OK
    reader = await listen("events")
    await forward(seconds=0.1)
    shooter = world.robot("b")
    shooter[Gimbal].move_to(pitch=math.atan2(0.20 - 0.09, 1.3))
    await forward(seconds=1)
    shooter[Blaster].fire()
    await forward(seconds=0.5)
    assert await events_of(reader) == b"armor event hit 2 0;"


async def test_armor_events_reach_every_reader_until_off(client, world, forward, listen) -> None:
    first, second = await listen("events"), await listen("events")
    await client.ask("armor event hit on;")
    await client.ask("armor event hit on;")
    world.stage.touch_plate("a", PlatePlace.REAR)
    await forward(seconds=0.1)
    assert await events_of(first) == await events_of(second) == b"armor event hit 1 2;"
    await client.ask("armor event hit off;")
    world.stage.touch_plate("a", PlatePlace.LEFT)
    await forward(seconds=1)
    assert await events_of(first) == b""


async def test_applause(client, world, forward, listen) -> None:
    reader = await listen("events")
    await client.ask("sound event applause on;")
    await forward(seconds=0.5)
    here = world.truth.pose_of("a")
    world.stage.make_sound(claps(2), Point(here.x + 1, here.y))
    await forward(seconds=3)
    assert b"sound event applause 2;" in await events_of(reader)


async def test_adapters_read_the_world(client, world, forward, listen) -> None:
    reader = await listen("events")
    await client.ask("sensor_adapter event io_level on;")
    world.stage.apply_voltage("a", 3, 2, 2.5)
    assert await client.ask("sensor_adapter adc id 3 port 2 ?;") == "2.5;"
    assert await client.ask("sensor_adapter io_level id 3 port 2 ?;") == "1;"
    assert await events_of(reader) == b"sensor_adapter event io_level (3, 2, 1);"
    await forward(seconds=0.25)
    world.stage.apply_voltage("a", 3, 2, 0.0)
    assert float((await client.ask("sensor_adapter pulse_period id 3 port 2;"))[:-1]) == pytest.approx(250, abs=10)


async def test_leds_shine_in_their_zones(client, robot) -> None:
    await client.ask("led control comp bottom_left r 10 g 20 b 30 effect solid;")
    light = robot[Light]
    assert light.lamps("left") == (Colour(10, 20, 30),)
    assert light.lamps("right") == (DARK,)
    await client.ask("led control comp top_right r 9 g 9 b 9 effect solid single_led_index 3;")
    assert [lamp != DARK for lamp in light.lamps("gimbal_right")] == [False, False, True] + [False] * 5


async def test_pwm_and_servo(client, robot, forward) -> None:
    await client.ask("pwm value 0x5 30;")
    await client.ask("pwm freq 1 200;")
    pwm = robot[PwmPorts]
    assert [pwm.signal(n).duty for n in (1, 2, 3)] == [0.3, 0.125, 0.3]
    assert pwm.signal(1).frequency == 200
    await client.ask("servo angle id 2 angle -90;")
    await forward(seconds=1)
    assert math.degrees(robot[Servos].angle(2)) == pytest.approx(-90, abs=1)
    assert await client.ask("servo angle id 2 ?;") == "-90.0;"
    await client.ask("servo speed id 1 speed 100;")
    await forward(seconds=0.5)
    assert math.degrees(robot[Servos].angle(1)) == pytest.approx(50, abs=5)
    await client.ask("servo stop;")
    stopped = robot[Servos].angle(1)
    await forward(seconds=0.5)
    assert robot[Servos].angle(1) == pytest.approx(stopped, abs=0.01)


async def test_arm_in_centimetres_from_power_on(client, robot, forward) -> None:
    await client.ask("robotic_arm moveto x 5 y 4;")
    await forward(seconds=3)
    home = robot[Arm].home
    assert robot[Arm].position.x == pytest.approx(home.x + 0.05)
    assert await client.numbers("robotic_arm position ?;") == pytest.approx([5, 4])
    await client.ask("robotic_arm move x -1 y 0;")
    await forward(seconds=1)
    assert await client.numbers("robotic_arm position ?;") == pytest.approx([4, 4])


@FW70
async def test_arm_in_millimetres_from_the_shoulder(client, robot, forward) -> None:
    await client.ask("robotic_arm moveto x 150 y 50;")
    await forward(seconds=3)
    assert await client.ask("robotic_arm position ?;") == "150 50 ;"


async def test_gripper(client, forward) -> None:
    assert await client.ask("robotic_gripper close 4;") == OK
    await forward(seconds=0.2)
    assert await client.ask("robotic_gripper status ?;") == "1;"
    await forward(seconds=2)
    assert await client.ask("robotic_gripper status ?;") == "0;"


async def test_infrared_sees_the_wall(client, robot, forward) -> None:
    await client.ask("ir_distance_sensor measure on;")
    await forward(seconds=0.2)
    reported = float((await client.ask("ir_distance_sensor distance 1 ?;"))[:-1])
    seen = robot[RangeSensors].reading("ir_1")
    assert reported == pytest.approx(1000 * min(seen.distance, 10.0), abs=0.1)
    assert reported > 50


async def test_exposure_changes_the_picture(client, robot) -> None:
    normal = (await robot[Camera].capture()).luma.mean()
    await client.ask("camera exposure small;")
    assert (await robot[Camera].capture()).luma.mean() < normal - 5


async def test_video_for_several_who_come_when_they_like(client, robot, forward, listen) -> None:
    import av

    early = await listen("video")
    assert await client.ask("stream on;") == OK
    assert await client.ask("stream on;") == OK
    pictures: list[int] = []
    late = None
    codecs = [av.CodecContext.create("h264", "r") for _ in range(2)]
    for codec in codecs:
        codec.thread_count = 1
    data = [b"", b""]
    for beat in range(30):
        await forward(seconds=1 / 30)
        await settle()
        if beat == 10:
            late = await listen("video")
        for number, reader in enumerate((early, late)):
            if reader is not None and reader._buffer:
                data[number] += await reader.read(1 << 20)
    for codec, received in zip(codecs, data, strict=True):
        packets = codec.parse(received) + codec.parse(b"")
        pictures.append(sum(len(codec.decode(packet)) for packet in packets))
    assert pictures[0] >= 25
    assert pictures[1] >= 15
    assert await client.ask("stream off;") == OK
    await asyncio.sleep(0.01)
    early._buffer.clear()
    await forward(seconds=0.2)
    await asyncio.sleep(0.01)
    assert not early._buffer


async def test_audio_is_a_packet_a_write(client, forward, listen) -> None:
    import av

    reader = await listen("audio")
    await client.ask("audio on;")
    packets = []
    for _ in range(30):
        await forward(seconds=0.02)
        await settle()
        if reader._buffer:
            packets.append(await reader.read(4096))
    assert len(packets) >= 20
    codec = av.CodecContext.create("opus", "r")
    codec.sample_rate, codec.layout = 48000, "mono"
    assert sum(frame.samples for p in packets[1:] for frame in codec.decode(av.Packet(p))) >= 960 * 15


async def test_nothing_is_drawn_while_no_one_looks(client, robot, forward, monkeypatch) -> None:
    drawn = []
    monkeypatch.setattr(type(robot[Camera]), "subscribe", lambda _self: drawn.append(1))
    await client.ask("stream on;")
    await forward(seconds=0.2)
    assert not drawn


async def test_ai_pushes_what_is_seen_and_excludes(client, world, robot, pushes, forward) -> None:
    world.stage.place("a", Pose(4.5, 3.4, 0.0))
    assert await client.ask("AI push marker on line on;") == OK
    assert await client.ask("AI push person on robot off;") == FAIL
    await forward(seconds=1)
    texts = pushes.texts()
    markers = [text for text in texts if text.startswith("AI push marker")]
    assert len(markers) >= 10
    words = markers[-1].rstrip(";").split()[3:]
    assert len(words) == 1 + 5 * int(words[0])
    assert int(words[0]) >= 1
    assert set(words[1::5]) <= {"11", "12", "8"}, "the red ones of the east wall"
    assert any(text.startswith("AI push line") for text in texts)
    assert await client.ask("AI push marker off person on line off;") == OK
    await forward(seconds=1)
    assert {text.split()[2] for text in pushes.texts()[2:]} <= {"person", "marker", "line"}
    await client.ask("AI push person off;")
    pushes.drain()
    await forward(seconds=1)
    assert pushes.texts() == []


@FW70
async def test_robots_push_everything_of_module_in_one_datagram(client, pushes, forward) -> None:
    await client.ask("chassis push position on attitude on status on freq 10;")
    await forward(seconds=1.001)
    texts = pushes.texts()
    assert len(texts) == 10
    assert texts[0].startswith("chassis push position 0.000 0.000 ; attitude ")
    assert texts[0].endswith(" ;;")
    await client.ask("chassis push position off attitude off status off;")
    await client.ask("chassis push attitude on afreq 20;")
    await forward(seconds=1.001)
    assert len(pushes.texts()) == 25, "robots' 20 Hz is 25"


async def test_keys_and_mouse(client, robot, pushes, forward) -> None:
    pilot = robot[InputDevice]
    pilot.press("w")
    await client.ask("game_msg on;")
    pilot.click(MouseButton.LEFT)
    pilot.move_mouse(0.5, -1)
    assert pushes.texts() == [
        "game msg push [0, 6, 2, 0, 0, 0, 1, 87];",
        "game msg push [0, 6, 2, 50, -100, 1, 1, 87];",
    ]
    await forward(seconds=1.001)
    assert len(pushes.texts()) == 10
    await client.ask("game_msg off;")
    pilot.release("w")
    assert pushes.texts() == []


async def test_the_end_puts_everything_back(client, robot, forward, connect) -> None:
    for text in (
        "blaster bead 4;", "armor sensitivity 9;", "pwm value 1 99;", "ir_distance_sensor measure on;",
        "camera exposure large;", "robot mode free;", "stream on;", "AI push line on;", "armor event hit on;",
        "gimbal speed p 10;", "servo speed id 1 speed 50;",
    ):  # fmt: skip
        assert await client.ask(text) == OK
    await client.close()
    await forward(seconds=0.5)
    assert (robot[Blaster].beads, robot[Armor].sensitivity, robot[Camera].exposure) == (1, 5, 0.0)
    assert robot[PwmPorts].signal(1).duty == 0.125
    assert not robot[RangeSensors].measuring
    assert not robot.actions.running()
    assert await (await connect()).ask("robot mode ?;") == "not in sdk mode;"


@pytest.mark.world("empty", body="universal")
async def test_arm_and_gripper_fail_while_stopped(robot, connect):
    client = await connect()
    await client.ask("command;")
    moves = ("robotic_arm recenter;", "robotic_gripper close leve 1;", "servo angle id 1 angle 9;", "blaster fire;")
    robot[EmergencyStop].engage()
    assert [await client.ask(move) for move in moves] == ["fail;"] * 4
    robot[EmergencyStop].release()
    assert await client.ask(moves[-1]) == "ok;"
