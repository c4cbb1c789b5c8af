"""Connections: order, several clients, bad input, and what happens when a client is gone."""

import asyncio
import random
import socket
from collections.abc import Callable, Sequence

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.geometry import Twist
from roboglot.model.inputs.fairness import Fairness, Use
from roboglot.protocols.robomaster import limits
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.robomaster.stops import stops
from tests.protocols.held_fairness import held
from tests.protocols.robomaster.text_client import ADDRESS

FLOOD = 50_000
PATIENCE = 100  # s, on a busy machine


class Scripted(Fairness):
    """Lets clients wait as the test says."""

    waits: Sequence[float] = ()

    def wait(self, share: Use) -> float:
        super().wait(share)
        first, *self.waits = self.waits or (0.0,)
        return first


async def until(condition: Callable[[], object]) -> None:
    """Wait for something that the other end does unprompted and unreported."""
    async with asyncio.timeout(PATIENCE):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


async def test_one_reply_per_command_in_order(client) -> None:
    client.send("robot mode ?;hello;robot battery ? seq 1;chassis stop;;\r\nrobot mode ? seq 2;\r\n")
    assert await client.reply() == "chassis_lead;"
    assert await client.reply() == "command format error: command parse error;"
    assert (await client.reply()).endswith(" seq 1 ;")
    assert await client.reply() == "ok;"
    assert await client.reply() == "chassis_lead seq 2 ;"


async def test_a_reply_is_one_segment(client) -> None:
    for text in ("chassis status ?;", "hello seq 5;"):
        client.send(text)
        assert (await client.reader.read(4096)).endswith(b";")


async def test_a_command_in_pieces(client) -> None:
    for piece in ("robot ", "mode", " ?", ";"):
        client.send(piece)
        await asyncio.sleep(0.005)
    assert await client.reply() == "chassis_lead;"


async def test_text_without_its_end_is_explained(client, monkeypatch, caplog) -> None:
    """Some clients send no ``;``, which robots run all the same: without a word, ours seemed dead."""
    monkeypatch.setattr(limits, "UNFINISHED_AFTER", 0.0)
    client.send("robot mode ?")
    await until(lambda: "sent 'robot mode ?' and no ';' behind it: every command ends in ';'" in caplog.text)
    client.send(";")
    assert await client.reply() == "chassis_lead;"
    client.send("robot mode ?;robot ba")
    assert await client.reply() == "chassis_lead;"
    await client.close()
    assert caplog.text.count("no ';' behind it") == 1


async def test_thousands_in_one_go(client) -> None:
    client.send("robot mode ?;" * 5000)
    for _ in range(5000):
        assert await client.reply() == "chassis_lead;"


async def test_the_tail_goes_with_its_client(connect) -> None:
    first = await connect()
    first.send("command;robot mod")
    assert await first.reply() == "ok;"
    await first.close()
    second = await connect()
    assert await second.ask("version;") == "version 00.00.00.70;"


async def test_several_clients_share_a_session(client, connect) -> None:
    other = await connect()
    assert await other.ask("robot mode ?;") == "chassis_lead;"
    assert await other.ask("command;") == "Already in SDK mode;"
    assert await other.ask("robot mode free;") == "ok;"
    assert await client.ask("robot mode ?;") == "free;"
    await client.close()
    assert await other.ask("robot mode ?;") == "free;", "the last one ends the session"
    await other.close()
    third = await connect()
    assert await third.ask("robot mode ?;") == "not in sdk mode;"


async def test_a_silent_connection_keeps_no_session(client, connect) -> None:
    silent = await connect()
    await client.close()
    assert await silent.ask("robot mode ?;") == "not in sdk mode;"


@pytest.mark.parametrize(
    "text", ["chassis speed x 0.4;", "chassis move x 2;", "chassis move x 2 wait_for_complete true;"]
)
async def test_the_robot_stops_when_its_client_is_gone(client, robot, world, forward, text: str) -> None:
    client.send(text)
    await asyncio.sleep(0.05)
    start = world.truth.pose_of(robot.id)
    await forward(seconds=1)
    assert world.truth.pose_of(robot.id).distance_to(start) > 0.1
    await client.close()
    await forward(seconds=0.5)
    stopped = world.truth.pose_of(robot.id)
    assert not robot.actions.running(BASE)
    await forward(seconds=1)
    assert world.truth.pose_of(robot.id).distance_to(stopped) < 0.002


async def test_robot_stops_when_its_driver_leaves_among_others(client, connect, robot, forward) -> None:
    monitor = await connect()
    assert await monitor.ask("robot mode ?;") == "chassis_lead;"
    await client.ask("chassis speed z 60;")
    await forward(seconds=1)
    assert await monitor.ask("chassis status ?;") != ""
    await monitor.close()
    await forward(seconds=0.5)
    assert abs(robot[Base].velocity.yaw) > 0.9, "a client that only looked takes nothing along"
    monitor = await connect()
    assert await monitor.ask("robot mode ?;") == "chassis_lead;"
    await client.close()
    await forward(seconds=0.5)
    assert abs(robot[Base].velocity.yaw) < 0.02
    assert await monitor.ask("robot mode ?;") == "chassis_lead;", "the session goes on"


async def test_the_robot_stops_at_quit_and_then_answers(client, robot, forward) -> None:
    await client.ask("chassis speed x 0.4;")
    await forward(seconds=1)
    client.send("quit;")
    await asyncio.sleep(0.02)
    await forward(seconds=1)
    assert await client.reply() == "ok;"
    assert robot[Base].velocity.speed < 0.02


async def test_a_reset_is_a_disconnect_too(client, robot, forward) -> None:
    await client.ask("chassis speed x 0.4;")
    await forward(seconds=1)
    client.writer.transport.abort()
    await asyncio.sleep(0.05)
    await forward(seconds=0.5)
    assert robot[Base].velocity.speed < 0.02


async def test_client_that_only_finishes_writing_is_gone_too(client, robot, forward) -> None:
    await client.ask("chassis speed x 0.4;")
    client.send("robot mode ?;")
    client.writer.write_eof()
    assert await client.reply() == "chassis_lead;"
    assert await client.ended()
    await forward(seconds=1)
    assert robot[Base].velocity.speed < 0.02


async def test_another_door_keeps_driving_when_our_client_goes(client, robot, forward) -> None:
    await client.ask("chassis speed x 0.2;")
    theirs = robot[Driving].drive(Twist(0.1), source="someone else")
    await forward(seconds=1)
    await client.close()
    await forward(seconds=1)
    assert robot.actions.running(BASE) == [theirs]


async def test_new_session_may_drive_while_old_one_brakes(client, connect, robot, forward) -> None:
    await client.ask("chassis speed x 0.4;")
    await forward(seconds=1)
    await client.close()
    other = await connect()
    assert await other.ask("command;") == "ok;"
    assert await other.ask("chassis speed x 0.2;") == "ok;"
    await forward(seconds=2)
    assert robot[Base].velocity.x == pytest.approx(0.2, abs=0.03)


async def test_garbage_harms_no_one(client, connect) -> None:
    other = await connect()
    other.send(bytes(range(256)) * 40 + b";")
    assert await other.reply() == "command format error: command parse error;"
    assert await client.ask("robot mode ?;") == "chassis_lead;"


@pytest.mark.slow
async def test_mutated_commands_get_one_answer_each(client, connect) -> None:
    """Every answer is one that the protocol knows, or numbers."""
    other = await connect()
    dice = random.Random(7)
    words = "chassis robot speed move wheel push mode position attitude status x y z vxy freq on off ? seq 1 -2 0x7 1e9"
    pool = [*words.split(), "free", "wait_for_complete", "true", "nan", "\x00", "\u96ea", "9" * 400, "", "\r", "'"]
    for _round in range(60):
        lines = [" ".join(dice.choices(pool, k=dice.randint(1, 9))) for _ in range(50)]
        lines = [line for line in lines if line.strip() and "quit" not in line and "wait_for_complete" not in line]
        client.send(";".join([*lines, "version"]) + ";")
        for _ in lines:
            reply = (await client.reply()).rstrip(";")
            known = reply.startswith(("ok", "fail", "command format error: ", "chassis_lead", "free"))
            assert known or all(part.lstrip("-").replace(".", "").isdigit() for part in reply.split() if part != "seq")
        assert await client.reply() == "version 00.00.00.70;", "no answer too many, none too few"
    assert await other.ask("robot mode ?;") in ("chassis_lead;", "free;")


async def test_a_megabyte_without_end_harms_no_one(client, connect) -> None:
    other = await connect()
    other.send(b"x" * 1_000_000)
    assert await client.ask("robot mode ?;") == "chassis_lead;"
    other.send(";")
    assert await other.reply() == "command format error: command parse error;"
    assert await other.ask("version;") == "version 00.00.00.70;"


@pytest.mark.slow
async def test_flood_behind_a_waiting_command_is_answered_whole(client, connect, door, robot, forward) -> None:
    client.send("chassis move x 1 wait_for_complete true;")
    await until(robot.actions.running)
    client.send("robot mode ?;" * FLOOD)
    (flooded,) = door._connections
    await until(lambda: flooded._resting)
    assert len(flooded._commands) < FLOOD, "the rest waits at the sender"
    other = await connect()
    assert await other.ask("version;") == "version 00.00.00.70;"
    await forward(seconds=5)
    assert await client.reply() == "ok;"
    for _ in range(FLOOD):
        assert await client.reply() == "chassis_lead;"


async def test_flood_waits_for_turns_and_is_answered(connect, robot) -> None:
    robot.fairness = fairness = Scripted(lambda: 0.0, lambda: 0.0)
    greedy = await connect()
    assert await greedy.ask("command;") == "ok;"
    fairness.waits = [0.01, 0.01, 0.0, 0.01]
    greedy.send("robot mode ?;" * (3 * limits.BATCH_MAX))
    for _ in range(3 * limits.BATCH_MAX):
        assert await greedy.reply() == "chassis_lead;"
    assert not fairness.waits
    fairness.waits = [60.0]
    greedy.send("robot mode ?;")
    await until(lambda: not fairness.waits)
    assert await (await connect()).ask("version;") == "version 00.00.00.70;"
    await greedy.close()


async def test_each_of_many_stops_counts_once(connect, robot) -> None:
    fairness, client = held(robot), await connect()
    await client.ask("command;")
    fairness.on = True
    for number in range(10):
        assert await client.ask(f"chassis speed x 0 y 0 z 0 seq {number};") == f"ok seq {number} ;"


async def test_stop_waits_for_no_other_client(connect, robot) -> None:
    fairness, greedy = held(robot), await connect()
    assert await greedy.ask("command;") == "ok;"
    fairness.on = True
    greedy.send("robot mode ?;")
    await until(lambda: fairness.waited)
    greedy.send("version;chassis speed x 0 y 0.0 z -0;")
    for reply in ("chassis_lead;", "version 00.00.00.70;", "ok;"):  # those before it go with it, in order
        assert await greedy.reply() == reply
    asked = len(fairness.waited)
    greedy.send("chassis speed x 0.1 y 0 z 0;")
    await until(lambda: len(fairness.waited) > asked)
    fairness.on = False
    assert await greedy.reply() == "ok;"


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("chassis wheel w1 0 w2 0 w3 0 w4 0 seq 7", True),
        ("gimbal speed p 0 y 0", True),
        ("robotic_arm stop", True),
        ("quit", True),
        ("chassis speed ?", False),
        ("chassis speed x", False),
        ("chassis wheel w1 0 w2 0 w3 0 w4 1", False),
        ("chassis move x 0", False),
        ("chassis speed x zero", False),
        ("version seq x", False),
        (None, False),
    ],
)
def test_commands_to_stop_are_known(command: str | None, expected: bool) -> None:
    assert stops(command) is expected


async def test_client_that_is_not_read_from_can_leave(client, door, robot, forward) -> None:
    client.send("chassis speed x 0.4;chassis move x 2 wait_for_complete true;")
    await until(robot.actions.running)
    await forward(seconds=0.5)
    client.send("robot mode ?;" * FLOOD)
    (flooded,) = door._connections
    await until(lambda: flooded._resting)
    client.writer.close()
    async with asyncio.timeout(PATIENCE):
        while robot.actions.running():
            await forward(seconds=0.1)
            await asyncio.sleep(0.01)
    assert robot[Base].velocity.speed < 0.02


async def test_unread_replies_are_not_piled_up(connect, door) -> None:
    client = await connect(buffer=4096)
    client.writer.transport.pause_reading()
    await until(lambda: bool(door._connections))
    for connection in door._connections:
        connection.transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    (unread,) = door._connections
    async with asyncio.timeout(PATIENCE):
        while unread._writable.is_set() or not unread._resting:
            client.send("nonsense seq 18446744073709551615;" * 200)
            await asyncio.sleep(0.005)
    low, high = unread.transport.get_write_buffer_limits()  # full at high; the kernel may take some again
    assert high == limits.OUTPUT_MAX
    assert low < unread.transport.get_write_buffer_size() < high + 1000
    other = await connect()
    assert await other.ask("version;") == "version 00.00.00.70;"


async def test_no_more_clients_than_allowed(connect) -> None:
    clients = [await connect() for _ in range(limits.CONTROL_CONNECTIONS_MAX)]
    extra = await connect()
    assert await extra.ended()
    assert await clients[-1].ask("version;") == "version 00.00.00.70;"
    await clients[0].close()
    late = await connect()
    assert await late.ask("version;") == "version 00.00.00.70;"


async def test_the_event_port_listens_before_anything_else(event_port: int) -> None:
    reader, writer = await asyncio.open_connection(ADDRESS, event_port)
    writer.write(b"ignored" * 1000)
    await writer.drain()
    await asyncio.sleep(0.02)
    assert not reader.at_eof()
    writer.close()


async def test_a_taken_address_is_named(door, robot) -> None:
    port = int(door.endpoints[0].address.rpartition(":")[2])
    second = RoboMasterDoor(robot, ADDRESS, RoboMasterConfig(control_port=port, event_port=0))
    with pytest.raises(OSError, match=rf"{ADDRESS}.*{port}"):
        await second.start()


async def test_an_address_that_is_none_is_reported(robot) -> None:
    with pytest.raises(OSError, match="no-such-host is not an IPv4 address"):
        await RoboMasterDoor(robot, "no-such-host", RoboMasterConfig(control_port=0, event_port=0)).start()


async def test_a_client_that_vanishes_will_be_noticed(client, door) -> None:
    (connection,) = door._connections
    accepted = connection.transport.get_extra_info("socket")
    assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 0  # it would end who does not read, too


async def test_closing_stops_the_robot_and_frees_the_ports(robot, forward, pushes, broadcasts) -> None:
    config = RoboMasterConfig(control_port=0, event_port=0, push_port=pushes.port, broadcast_port=broadcasts.port)
    door = RoboMasterDoor(robot, ADDRESS, config)
    await door.start()
    port = int(door.endpoints[0].address.rpartition(":")[2])
    reader, writer = await asyncio.open_connection(ADDRESS, port)
    writer.write(b"command;chassis speed x 0.4;")
    assert await reader.readuntil(b";") == b"ok;"
    assert await reader.readuntil(b";") == b"ok;"
    await forward(seconds=1)
    await door.close()
    await forward(seconds=1)
    assert robot[Base].velocity.speed < 0.02
    writer.close()
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection(ADDRESS, port)
