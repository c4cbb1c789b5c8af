"""Transcripts of the chapters beyond sdk, robot and chassis: valid, edges, just outside, wrong, missing, twice."""

import asyncio

import pytest

PARSE_ERROR = "command format error: command parse error;"
OK, FAIL = "ok;", "fail;"
FW70 = pytest.mark.parametrize("door", [{"profile": "fw70"}], indirect=True)

pytestmark = pytest.mark.world("empty", body="robomaster_ep")

TRANSCRIPTS = {
    # gimbal; those that wait for the end are sent without waiting
    "gimbal speed p 1 y 1": OK,
    "gimbal speed y -450 p 450": OK,
    "gimbal speed p 451": FAIL,
    "gimbal speed y -450.5": FAIL,
    "gimbal speed p fast": FAIL,
    "gimbal speed": PARSE_ERROR,
    "gimbal speed p 1 p 2": OK,
    "gimbal move p 10 wait_for_complete false": OK,
    "gimbal move p 55 y -55 vp 540 vy 540 wait_for_complete false": OK,
    "gimbal move p 55.1 wait_for_complete false": FAIL,
    "gimbal move y -56 wait_for_complete false": FAIL,
    "gimbal move p 5 vp 0 wait_for_complete false": FAIL,
    "gimbal move p 5 vy 0 wait_for_complete false": OK,  # an axis without motion needs no speed
    "gimbal move p 0 y 5 vp 0 vy 0 wait_for_complete false": OK,  # in chassis_lead yaw does not move
    "gimbal moveto p 0 y 0 vp 0 vy 0 wait_for_complete false": OK,
    "gimbal moveto p 20 vp 0 wait_for_complete false": FAIL,
    "gimbal move p 5 vp 541 wait_for_complete false": FAIL,
    "gimbal move p 5 wait_for_complete perhaps": FAIL,
    "gimbal move": PARSE_ERROR,
    "gimbal moveto p 10 y -20 vp 0.1 wait_for_complete false": OK,
    "gimbal moveto p -25 y 250 wait_for_complete false": OK,
    "gimbal moveto p 30 y -250 wait_for_complete false seq 3": "ok seq 3 ;",
    "gimbal moveto p 30.1 wait_for_complete false": FAIL,
    "gimbal moveto p -26 wait_for_complete false": FAIL,
    "gimbal moveto y 251 wait_for_complete false": FAIL,
    "gimbal moveto p up wait_for_complete false": FAIL,
    "gimbal moveto": PARSE_ERROR,
    "gimbal suspend": OK,
    "gimbal resume": OK,
    "gimbal recenter wait_for_complete false": OK,
    "gimbal stop": OK,
    "gimbal attitude": PARSE_ERROR,
    "gimbal push attitude on": OK,
    "gimbal push attitude on afreq 20": OK,
    "gimbal push attitude off": OK,
    "gimbal push attitude": FAIL,
    "gimbal push attitude afreq 5": FAIL,
    "gimbal push attitude on afreq 2": FAIL,
    "gimbal push freq 10": FAIL,
    "gimbal push position on": FAIL,
    "gimbal push": PARSE_ERROR,
    # blaster
    "blaster bead 1": OK,
    "blaster bead 5": OK,
    "blaster bead 0": FAIL,
    "blaster bead 6": FAIL,
    "blaster bead 2.5": FAIL,
    "blaster bead": PARSE_ERROR,
    "blaster bead 2 3": OK,
    "blaster fire": OK,
    "blaster fire ?": PARSE_ERROR,
    # armor and sound
    "armor sensitivity 1": OK,
    "armor sensitivity 10": OK,
    "armor sensitivity 0": FAIL,
    "armor sensitivity 11": FAIL,
    "armor sensitivity high": FAIL,
    "armor sensitivity": PARSE_ERROR,
    "armor event hit on": OK,
    "armor event hit off": OK,
    "armor event hit maybe": FAIL,
    "armor event hit": FAIL,
    "armor event miss on": FAIL,
    "armor event": PARSE_ERROR,
    "sound event applause on": OK,
    "sound event applause off": OK,
    "sound event whistle on": FAIL,
    "sound event": PARSE_ERROR,
    # pwm
    "pwm value 1 50": OK,
    "pwm value 0x3f 0": OK,
    "pwm value data 100 port 0x20": OK,
    "pwm value 1 100.5": FAIL,
    "pwm value 1 -1": FAIL,
    "pwm value 0 5": OK,  # no output
    "pwm value 0x40 5": OK,  # bits without an output are ignored
    "pwm value 0xffff 5": OK,
    "pwm freq 0xffff 100": OK,
    "pwm value 65536 5": FAIL,
    "pwm value 1": PARSE_ERROR,
    "pwm freq 1 1000": OK,
    "pwm freq 1 0": FAIL,
    "pwm freq 1 1.5": FAIL,
    "pwm freq": PARSE_ERROR,
    # led
    "led control comp all r 255 g 0 b 0 effect solid": OK,
    "led control effect blink comp bottom_back": OK,
    "led control comp top_all effect scrolling": OK,
    "led control comp top_left|bottom_front r 1 effect pulse": OK,
    "led control comp top_left effect solid single_led_index 8": OK,
    "led control comp all effect off": OK,
    "led control comp bottom_front effect scrolling": FAIL,
    "led control comp top_left effect blink single_led_index 1": FAIL,
    "led control comp top_left effect solid single_led_index 9": FAIL,
    "led control comp all r 256 effect solid": FAIL,
    "led control comp all r -1 effect solid": FAIL,
    "led control comp roof effect solid": FAIL,
    "led control comp all effect rainbow": FAIL,
    "led control comp all r 255": PARSE_ERROR,
    "led control": PARSE_ERROR,
    # sensor adapter
    "sensor_adapter adc id 1 port 1 ?": "0.0;",
    "sensor_adapter adc port 2 id 6 ?": "0.0;",
    "sensor_adapter adc id 7 port 1 ?": FAIL,
    "sensor_adapter adc id 1 port 3 ?": FAIL,
    "sensor_adapter adc id 1 ?": PARSE_ERROR,
    "sensor_adapter adc id 1 port 1": PARSE_ERROR,
    "sensor_adapter io_level id 1 port 1 ?": "0;",
    "sensor_adapter io_level id 0 port 1 ?": FAIL,
    "sensor_adapter pulse_period id 1 port 1": "0;",
    "sensor_adapter pulse_period id 1 port 1 ?": "0;",
    "sensor_adapter event io_level on": OK,
    "sensor_adapter event io_level off": OK,
    "sensor_adapter event adc on": FAIL,
    # infrared
    "ir_distance_sensor measure on": OK,
    "ir_distance_sensor measure off": OK,
    "ir_distance_sensor measure 1": FAIL,
    "ir_distance_sensor measure": PARSE_ERROR,
    "ir_distance_sensor distance 1 ?": "0.0;",
    "ir_distance_sensor distance id 4 ?": "0.0;",
    "ir_distance_sensor distance 5 ?": FAIL,
    "ir_distance_sensor distance 0 ?": FAIL,
    "ir_distance_sensor distance ?": PARSE_ERROR,
    # servo
    "servo angle id 1 angle 20": OK,
    "servo angle angle -180 id 3": OK,
    "servo angle id 1 angle 180.5": FAIL,
    "servo angle id 4 angle 5": FAIL,
    "servo angle id 1": PARSE_ERROR,
    "servo angle id 1 ?": "0.0;",
    "servo angle id 0 ?": FAIL,
    "servo speed id 1 speed 1800": OK,
    "servo speed id 1 speed -1801": FAIL,
    "servo speed id 1": PARSE_ERROR,
    "servo recenter id 2": OK,
    "servo stop": OK,
    "servo stop id 1": OK,
    "servo stop id 9": FAIL,
    # arm and gripper
    "robotic_arm move x 5 y 5": OK,
    "robotic_arm move x 50 y 0": FAIL,
    "robotic_arm move x 5": PARSE_ERROR,
    "robotic_arm move x far y 1": FAIL,
    "robotic_arm moveto y 5 x 5": OK,
    "robotic_arm moveto x 0 y -20": FAIL,
    "robotic_arm moveto": PARSE_ERROR,
    "robotic_arm recenter": OK,
    "robotic_arm stop": OK,
    "robotic_arm position ?": "0.000 0.000;",
    "robotic_gripper open": OK,
    "robotic_gripper open 1": OK,
    "robotic_gripper open leve 4": OK,
    "robotic_gripper close level 2": OK,
    "robotic_gripper close 5": FAIL,
    "robotic_gripper open 0": FAIL,
    "robotic_gripper stop": OK,
    "robotic_gripper status ?": "2;",
    "robotic_gripper status": PARSE_ERROR,
    # AI
    "AI attribute line_color red": OK,
    "AI attribute marker_color blue marker_dist 3": OK,
    "AI attribute marker_dist 0.4": FAIL,
    "AI attribute marker_dist 3.1": FAIL,
    "AI attribute line_color pink": FAIL,
    "AI attribute marker_color green": FAIL,
    "AI attribute": PARSE_ERROR,
    "AI push marker on line on": OK,
    "AI push people on": OK,
    "AI push person on gesture on": FAIL,
    "AI push people on pose on line on": FAIL,
    "AI push person off": OK,
    "AI push person maybe": FAIL,
    "AI push cats on": FAIL,
    "AI push": PARSE_ERROR,
    "ai push line on": PARSE_ERROR,
    # camera, streams, game data
    "camera exposure default": OK,
    "camera exposure large": OK,
    "camera exposure huge": FAIL,
    "camera exposure": PARSE_ERROR,
    "stream on": OK,
    "stream off": OK,
    "stream maybe": PARSE_ERROR,
    "audio on": OK,
    "audio off": OK,
    "game_msg on": OK,
    "game_msg off": OK,
    "game_msg": PARSE_ERROR,
}


async def test_transcript(client, robot) -> None:
    """Each from a fresh session, so that none depends on another."""
    wrong = {}
    for text, reply in TRANSCRIPTS.items():
        if (got := await client.ask(f"{text};")) != reply:
            wrong[text] = got
        client.send("quit;")
        await asyncio.sleep(0)
        for _ in range(40):
            await robot.clock.advance(0.05)
            if client.reader._buffer:
                break
        assert await client.reply() == OK
        assert await client.ask("command;") == OK
    assert not wrong


@FW70
@pytest.mark.parametrize(
    ("text", "reply"),
    [
        ("gimbal moveto p 35 wait_for_complete false;", "ok;"),
        ("gimbal moveto p -25 wait_for_complete false;", "fail;"),
        ("gimbal speed p 540;", "ok;"),
        ("gimbal speed p 1 y 5;", "fail;"),
        ("gimbal move y 500 wait_for_complete false;", "ok;"),
        ("blaster bead 8;", "ok;"),
        ("armor sensitivity 0;", "ok;"),
        ("chassis move x 1 vxy 2.6;", "fail;"),
        ("chassis move z 1 vz 9;", "fail;"),
        ("AI attribute marker_color green;", "ok;"),
        ("pwm value port 1 data 50;", "ok;"),
        ("robotic_gripper status ?;", "1 ;"),
        ("robotic_arm position ?;", "91 41 ;"),
        ("sensor_adapter adc id 1 port 1 ?;", "0 ;"),
        ("robot mode ?;", "chassis_lead ;"),
        ("version;", "version 00.00.00.70;"),
    ],
)
async def test_answers_equal_those_of_real_robots(client, text: str, reply: str) -> None:
    assert await client.ask(text) == reply


@pytest.mark.parametrize("door", [{"profile": "fw60", "lenient": True}], indirect=True)
async def test_a_client_that_never_sends_a_semicolon(connect) -> None:
    client = await connect()
    for text, reply in (("command", b"ok"), ("robot mode ?", b"chassis_lead "), ("hello", PARSE_ERROR[:-1].encode())):
        client.send(text)
        assert await client.reader.read(100) == reply
