"""Lines that are said again and again are answered in place, and are in no way other than the first one."""

from __future__ import annotations

import asyncio

from roboglot.model.components.motion.base import Base
from roboglot.model.components.system.network import Network
from roboglot.model.inputs.fairness import LENT, Fairness
from roboglot.protocols.robomaster import limits
from roboglot.wire.robomaster.lines import LINE_MAX

MODE = "robot mode ?;"


async def repeat(client, line: str = MODE, times: int = 3) -> list[str]:
    return [await client.ask(line) for _ in range(times)]


async def test_follower_sees_lines_said_before_it_came(client, robot) -> None:
    await repeat(client)
    seen: list[str] = []
    leave = robot.tap.listen(lambda exchange: seen.append(exchange.operation))
    await repeat(client)
    leave()
    await repeat(client)
    assert seen == ["robot mode ?"] * 6  # three requests, three replies


async def test_repeated_line_is_as_late_as_any(client, robot, forward) -> None:
    await repeat(client)
    robot[Network].delay = 0.5
    client.send(MODE)
    reply = asyncio.ensure_future(client.reply())
    await forward(seconds=0.3)
    assert not reply.done()
    await forward(seconds=0.4)
    assert await reply == "chassis_lead;"
    robot[Network].delay = 0.0


async def test_line_of_the_last_session_joins_the_next(client, connect, door) -> None:
    other = await connect()
    await repeat(other)
    assert await client.ask("quit;") == "ok;"
    assert await other.ask(MODE) == "not in sdk mode;"
    assert await client.ask("command;") == "ok;"
    await repeat(other)
    await client.close()
    assert door.context.active, "the other one keeps the session"
    assert await other.ask(MODE) == "chassis_lead;"


async def test_refusal_of_a_repeated_line_is_explained(client, robot, monkeypatch, caplog) -> None:
    await repeat(client, "chassis speed ?;")
    monkeypatch.setattr(type(robot[Base]), "wheel_speeds", property(lambda _self: 1 / 0))
    assert await client.ask("chassis speed ?;") == "fail;"
    assert "asked 'chassis speed ?': fail; (internal error" in caplog.text


async def test_part_of_a_line_is_no_line(client) -> None:
    await repeat(client)
    client.send("nonsense ")
    await asyncio.sleep(0)
    assert await client.ask(MODE) == "command format error: command parse error;"
    assert await client.ask(MODE) == "chassis_lead;"


async def test_end_of_an_overlong_line_is_no_line(client) -> None:
    await repeat(client)
    assert await client.ask(MODE + "x" * (LINE_MAX + 1)) == "chassis_lead;"
    await asyncio.sleep(0.01)
    assert await client.ask(MODE) == "command format error: command parse error;"
    assert await client.ask(MODE) == "chassis_lead;"


async def test_client_that_says_many_lines_fills_no_memory(client, door) -> None:
    for number in range(limits.LINES_MAX + 5):
        assert await client.ask(f"robot mode ? seq {number};") == f"chassis_lead seq {number} ;"
    assert len(door.context.repeated) <= limits.LINES_MAX


async def test_repeated_lines_count_in_the_share(connect, robot) -> None:
    robot.fairness = Fairness(lambda: 0.0, lambda: 0.0)
    client = await connect()
    await client.ask("command;")
    use = robot.fairness.of(":".join(str(part) for part in client.writer.get_extra_info("sockname")))
    await repeat(client, times=1 + LENT)  # the first is read, the others are known
    assert use.left == 0
    await client.ask(MODE)  # this one is timed
    assert (use.left, use.lent) == (LENT, LENT)


async def test_line_of_each_window_is_not_read_anew(connect, robot, door, monkeypatch) -> None:
    robot.fairness = Fairness(lambda: 0.0, lambda: 0.0)
    client = await connect()
    await client.ask("command;")
    await repeat(client)
    robot.fairness.of(":".join(str(part) for part in client.writer.get_extra_info("sockname"))).settle()
    (connection,) = door._connections
    monkeypatch.setattr(connection, "_read", lambda _data: connection.transport.abort())
    assert await client.ask(MODE) == "chassis_lead;"


async def test_last_moments_of_the_door_refuse_changes(client, robot) -> None:
    line = "chassis speed x 0.1 y 0 z 0;"
    await repeat(client, line)
    robot.starts.down = "the robot restarts"
    assert await repeat(client, line) == ["fail;"] * 3
    assert await client.ask(MODE) == "chassis_lead;"
