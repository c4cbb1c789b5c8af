"""SDK mode, versions, the robot chapter, sequence numbers, and everything that is refused."""

import asyncio
from dataclasses import replace

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.protocols.robomaster.table import TABLE, implemented
from roboglot.wire.contracts import contract

PARSE_ERROR = "command format error: command parse error;"


async def test_before_command_only_four_texts_are_understood(connect) -> None:
    client = await connect()
    assert await client.ask("robot mode ?;") == "not in sdk mode;"
    assert await client.ask("gimbal recenter;") == "not in sdk mode;"
    assert await client.ask("no such thing;") == "not in sdk mode;"
    assert await client.ask("robot\nmode ?;") == "not in sdk mode;"
    assert await client.ask("quit;") == "quit sdk mode failed;"
    assert await client.ask("version;") == "version 00.00.00.70;"
    assert await client.ask("version ?;") == "version 00.00.00.70;"
    assert await client.ask("command;") == "ok;"
    assert await client.ask("command;") == "Already in SDK mode;"
    assert await client.ask("robot mode ?;") == "chassis_lead;"


async def test_quit_resets_and_leaves(client) -> None:
    assert await client.ask("robot mode free;") == "ok;"
    assert await client.ask("quit;") == "ok;"
    assert await client.ask("robot mode ?;") == "not in sdk mode;"
    assert await client.ask("command;") == "ok;"
    assert await client.ask("robot mode ?;") == "chassis_lead;"


NUMBERED = [
    ("robot mode ? seq 7;", "chassis_lead seq 7 ;"),
    ("chassis stop seq 0x10;", "ok seq 16 ;"),
    ("chassis speed x 9 seq 3;", "fail seq 3 ;"),
    ("nonsense seq 3;", PARSE_ERROR.replace(";", " seq 3 ;")),
    ("robot mode ? seq;", "command format error: no seq value;"),
    ("robot mode ? seq x;", "command format error: seq parse error;"),
]


async def test_the_sequence_number_comes_back(client) -> None:
    for text, reply in NUMBERED:
        assert await client.ask(text) == reply, text


MODES_AND_BAD_TEXTS = [
    ("robot mode free;", "ok;"),
    ("robot mode chassis_lead;", "ok;"),
    ("robot mode mode free;", "ok;"),
    ("robot mode gimbal_lead;", "ok;"),
    ("robot mode FREE;", "fail;"),
    ("robot mode 1;", "fail;"),
    ("robot mode;", PARSE_ERROR),
    ("robot battery;", PARSE_ERROR),
    ("robot;", PARSE_ERROR),
    ("Robot mode ?;", PARSE_ERROR),
    ("command ?;", PARSE_ERROR),
    ("chassis move ?;", PARSE_ERROR),
    ("hello;", PARSE_ERROR),
    ("?;", PARSE_ERROR),
    ("\xff\x00;", PARSE_ERROR),
    ("robot mode free\nrobot battery ?;", PARSE_ERROR),
]


async def test_robot_mode_and_bad_texts(client) -> None:
    for text, reply in MODES_AND_BAD_TEXTS:
        assert await client.ask(text) == reply, text


async def test_mode_that_needs_gimbal_is_refused_without_one(client, robot) -> None:
    del robot._components[Gimbal]
    await client.ask("robot mode free;")
    assert await client.ask("robot mode gimbal_lead;") == "fail;"
    assert await client.ask("robot mode ?;") == "free;"


async def test_battery_is_whole_percent(client, robot) -> None:
    assert await client.ask("robot battery ?;") == f"{round(robot[Battery].state.percentage * 100)};"


async def test_a_part_that_the_robot_lacks_answers_fail(client, robot) -> None:
    del robot._components[Battery]
    assert await client.ask("robot battery ?;") == "fail;"
    assert await client.ask("robot mode ?;") == "chassis_lead;"


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("gimbal moveto p 45;", "p is -25 to 30; did you mean `gimbal moveto p 30`?"),
        ("chasis speed x 1;", "did you mean `chassis speed x 1`?"),
        ("servo angel id 1 ?;", "did you mean `servo angle id 1 ?`?"),
        ("servo angle id 4 ?;", "did you mean `servo angle id 3 ?`?"),
        ("chassis speed;", "it takes at least one of x, y, z; did you mean `chassis speed x 1`?"),
        ("gimbal move vp 30;", "it takes at least one of p, y; did you mean `gimbal move vp 30 p 1`?"),
        ("led control r 1;", "comp, effect missing; did you mean `led control r 1 comp all effect solid`?"),
        ("sound event bark on;", "did you mean `sound event applause on`?"),
        ("robotic_arm moveto x 500 y 0;", "did you mean `robotic_arm moveto x 12.9 y 0`?"),
        ("robotic_arm move x 0 y -90;", "did you mean `robotic_arm move x 0 y -14.1`?"),
        ("led control comp all effect solidd;", "did you mean `led control comp all effect solid`?"),
        ("chassis push position on pfreq 40;", "did you mean `chassis push position on pfreq 30`?"),
        ("blaster bead 9;", "num is a whole number 1 to 5; did you mean `blaster bead 5`?"),
    ],
)
async def test_a_refusal_names_the_nearest_valid_command(client, listen, caplog, text: str, hint: str) -> None:
    reader = await listen("explanations")
    await client.ask(text)
    assert hint in caplog.text
    explained = (await asyncio.wait_for(reader.readline(), 5)).decode()
    assert hint in explained
    advised = explained.rpartition("did you mean `")[2].partition("`")[0]
    at_once = " wait_for_complete false" if advised.startswith("gimbal") else ""
    assert await client.ask(f"{advised}{at_once};") not in ("fail;", "command format error: command parse error;")


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("chassis move x 0.1 vx 1;", "ok; (vx 1 have no effect; did you mean 'vxy'?)"),
        (
            "led control comp all r 1 effects blink effect solid;",
            "effects blink have no effect; did you mean 'effect'?",
        ),
        ("blaster bead 3 4;", "ok; (3 has no effect)"),
        ("stream on now;", "now has no effect"),
        ("robotic_gripper open leve 4;", ""),
        ("chassis wheel w1 0 w2 0 w3 0 w4 0;", ""),
    ],
)
async def test_words_without_effect_are_logged(client, listen, caplog, text: str, hint: str) -> None:
    reader = await listen("explanations")
    assert await client.ask(text) == "ok;"
    assert ("no effect" in caplog.text) is bool(hint)
    if hint:
        assert hint in caplog.text
        assert hint in (await asyncio.wait_for(reader.readline(), 5)).decode()


async def test_lost_link_is_logged_by_its_driver_alone(client, robot, caplog) -> None:
    """Each command of a client that drove on gave a warning of its own."""
    link = robot.add(Link, Link("robomaster://ep", robot.clock, robot.events, robot[Health]))
    link.move_to(LinkState.LOST, "no answer")
    for _ in range(3):
        assert await client.ask("chassis speed ?;") == "fail;"
    assert "asked" not in caplog.text
    assert await client.ask("chassis spd ?;") == PARSE_ERROR
    assert "asked 'chassis spd ?'" in caplog.text


async def test_a_client_cannot_forge_log_lines(client, caplog) -> None:
    await client.ask("x\nroot: all is well " + "y" * 500 + ";")
    (record,) = [record for record in caplog.records if "asked" in record.message]
    assert "\n" not in record.message
    assert len(record.message) < 400


async def test_the_log_of_refusals_has_an_end(client, caplog) -> None:
    for _ in range(150):
        await client.ask("nonsense;")
    assert sum("asked" in record.message for record in caplog.records) == 100


def test_completion_is_in_the_contract_and_whole() -> None:
    keys = {row.key for row in contract("robomaster")}
    assert implemented() == keys
    assert "version" not in implemented()
    assert not {operation.key for operation in TABLE if operation.partial} & implemented()


async def test_broken_part_is_fail_for_one_command_only(client, robot, caplog, monkeypatch) -> None:
    monkeypatch.setattr(type(robot[Base]), "wheel_speeds", property(lambda _self: 1 / 0))
    assert await client.ask("chassis speed ?;") == "fail;"
    assert "crashed" in caplog.text
    assert await client.ask("robot mode ?;") == "chassis_lead;"


async def test_kept_lines_find_the_current_handler(client, monkeypatch) -> None:
    async def other(_context: object) -> str:
        return "another"

    assert await client.ask("robot mode ?;") == "chassis_lead;"
    with monkeypatch.context() as patched:
        patched.setitem(TABLE._operations, "robot mode ?", replace(TABLE["robot mode ?"], handler=other))
        assert await client.ask("quit;") == "ok;"  # a session may keep who answers
        assert await client.ask("command;") == "ok;"
        assert await client.ask("robot mode ?;") == "another;"
    assert await client.ask("robot mode ?;") == "chassis_lead;"
