"""The server: admission, answers, and hostile clients."""

from __future__ import annotations

import asyncio
import json
import logging
import shlex
import time
from pathlib import Path

import grpc
import pytest

from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.cyberdog.stops import stops
from roboglot.protocols.cyberdog.table import extras, implemented, partly
from roboglot.simulation.world.world import World
from roboglot.wire.contracts import contract
from roboglot.wire.cyberdog.codes import FileError
from tests.protocols.cyberdog.phone import ADDRESS, Client, until
from tests.protocols.held_fairness import held


@pytest.fixture
def robot(walker: tuple[World, Robot]) -> Robot:
    return walker[1]


async def fails(client: Client) -> grpc.StatusCode:
    with pytest.raises(grpc.aio.AioRpcError) as caught:
        await client.raw(10001)
    return caught.value.code()


async def test_refused_handshake_leaves_a_line_in_the_log(door, pems, messages, client, caplog) -> None:
    assert "task_status" in await client.ask(10001)
    async with pems.channel(door.port, private_key=None, certificate_chain=None) as channel:
        assert await fails(Client(channel, messages)) is grpc.StatusCode.UNAVAILABLE
    await until(lambda: "was refused on port" in caplog.text)
    (line,) = [record for record in caplog.records if "was refused" in record.message]
    assert f"127.0.0.1 was refused on port {door.port}" in line.message


async def test_the_log_names_the_wrong_type(client, caplog) -> None:
    caplog.set_level(logging.INFO)
    assert await client.ask(1004, {"motion_id": "111"}) == {"error_code": 323}
    assert "motion_id must be a whole number, not text" in caplog.text
    assert await client.ask(1004, {}) == {"error_code": 323}
    assert "missing" in caplog.text
    assert await client.raw(1021, {"account": 7}) == await client.raw(1021, {})
    assert "1021: ignored: account must be text, not a whole number" in caplog.text


async def test_the_log_names_what_a_request_loses(client, caplog) -> None:
    fields = {"motion_id": 111, "cmd_source": 0, "vel_dest": [0.2, 0.0, 0.0], "pos_des": [0.1], "colour" * 20: 1}
    assert (await client.ask(1004, fields))["code"] == 0
    (line,) = [record for record in caplog.records if "ignored" in record.message]
    assert line.levelno == logging.WARNING
    assert "vel_dest is unknown; did you mean 'vel_des'?" in line.message
    assert "pos_des must have at least 3 entries" in line.message
    assert "colourcolour" in line.message
    assert "colour" * 20 not in line.message
    assert "cmd_source" not in line.message
    assert await client.ask(1004, {"motionid": 111}) == {"error_code": 323}
    assert "motionid is unknown; did you mean 'motion_id'?" in caplog.text


async def test_only_certificates_of_our_ca_get_in(door, pems, messages, tmp_path) -> None:
    other, cert, key = (path.read_bytes() for path in export_client(tmp_path / "other", tmp_path / "phone"))
    wrong = [
        pems.channel(door.port, private_key=None, certificate_chain=None),
        pems.channel(door.port, private_key=key, certificate_chain=cert),
        pems.channel(door.port, root_certificates=other),
        pems.channel(door.port, name=""),
        grpc.aio.insecure_channel(f"{ADDRESS}:{door.port}"),
    ]
    for channel in wrong:
        async with channel:
            assert await fails(Client(channel, messages)) is grpc.StatusCode.UNAVAILABLE
    async with pems.channel(door.port) as channel:
        assert await Client(channel, messages).ask(10001)


async def test_plaintext_is_a_switch_for_loopback(robot, data, messages) -> None:
    with pytest.raises(ValueError, match="loopback"):
        CyberDogDoor(robot, "0.0.0.0", CyberDogConfig(plaintext=True), data)
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, plaintext=True), data)
    await door.start()
    async with grpc.aio.insecure_channel(f"{ADDRESS}:{door.port}") as channel:
        assert await Client(channel, messages).ask(10001)
    await door.close()


async def test_a_taken_port_is_named(door, robot, data) -> None:
    second = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=door.port), data)
    with pytest.raises(OSError, match=f"{ADDRESS}:{door.port}"):
        await second.start()
    await second.close()


@pytest.mark.parametrize("text", ["", "{", "nonsense", "{'a': 1}", '{"a":NaN}', "[" * 50_000, "{}{}", '"\\ud800"'])
async def test_bad_json_is_answered_under_code_0(client, text) -> None:
    assert await client.raw(10001, text or " ") == [(0, '{"error_code":323}')]


@pytest.mark.parametrize("sent", [b"\x12\x02\xff\xfe", b"\x0d\x11\x27\x00\x00\x12\x01\xff", b"nonsense", b"\x12\x7f"])
async def test_unreadable_requests_are_answered_in_band(sent, client, messages, caplog) -> None:
    with caplog.at_level("INFO"):
        (said,) = await client.send("sendMsg", sent)
    assert messages.RecResponse.FromString(said) == messages.RecResponse(nameCode=0, data='{"error_code":323}')
    assert "cannot read a request of 127.0.0.1: it is not a SendRequest, or its params are not UTF-8" in caplog.text
    (chunk,) = await client.send("getFile", sent)
    assert messages.FileChunk.FromString(chunk).error_code == FileError.ARGUMENTS
    with pytest.raises(grpc.aio.AioRpcError) as caught:
        await client.send("heartbeat", sent)
    assert caught.value.code() is grpc.StatusCode.UNIMPLEMENTED


async def test_request_beyond_its_share_waits_but_to_stop(client, robot) -> None:
    fairness = held(robot)
    fairness.on = True
    asking = asyncio.ensure_future(client.ask(10001))
    await until(lambda: len(fairness.waited) > 3)
    still = {"motion_id": 303, "cmd_type": 1, "vel_des": [0, 0.0, 0]}
    for code, params in ((1002, still), (1002, {"motion_id": 303, "cmd_type": 2}), (6009, {"type": 5})):
        await client.raw(code, json.dumps(params))
    assert not asking.done()
    waited = len(fairness.waited)
    moving = asyncio.ensure_future(client.raw(1002, json.dumps(still | {"vel_des": [0.1, 0, 0]})))
    await until(lambda: len(fairness.waited) > waited + 3)
    assert not moving.done()
    fairness.on = False
    assert "task_status" in await asking
    await moving
    assert set(fairness.counted) == set(fairness.waited)


@pytest.mark.parametrize(
    ("code", "params", "expected"),
    [
        (1004, {"motion_id": 0}, True),
        (1004, {"motion_id": 111}, False),
        (1101, {}, True),
        (2002, {"type": "task", "id": "1", "target_id": ["t"], "operate": "shutdown"}, True),
        (2002, {"type": "task", "id": "1", "target_id": ["t"], "operate": "run"}, False),
        (1002, {"motion_id": 303}, False),
        (10001, {}, False),
    ],
)
def test_requests_to_stop_are_known(code: int, params: dict[str, object], expected: bool) -> None:
    assert stops(code, json.dumps(params)) is expected
    assert not stops(1002, "{")


@pytest.mark.parametrize("text", ["[]", "5", "null", '"text"', '{"motion_id":null}'])
async def test_incomplete_json_keeps_its_code(client, text) -> None:
    assert await client.raw(1004, text) == [(1004, '{"error_code":323}')]


async def test_unknown_codes_are_not_answered(client) -> None:
    for code in (0, 7, 1023, 4005, 5008, 424242, 2**32 - 1, 2002):
        assert await client.raw(code) == []
    assert await client.raw(424242, "{") == [(0, '{"error_code":323}')]


def test_all_codes_of_manual_and_real_robots_exist() -> None:
    assert {int(row.key) for row in contract("cyberdog")} <= {int(key) for key in implemented()}
    assert all(extras().values())


async def test_neither_files_nor_heartbeats_are_available(client) -> None:
    assert [chunk.error_code for chunk in await client.file(4002)] == [7]
    assert [chunk.error_code for chunk in await client.file(1001)] == [255]
    with pytest.raises(grpc.aio.AioRpcError) as caught:
        await client.heartbeat()
    assert caught.value.code() is grpc.StatusCode.UNIMPLEMENTED


async def test_oversize_message_is_refused_and_next_is_answered(client) -> None:
    with pytest.raises(grpc.aio.AioRpcError) as caught:
        await client.raw(10001, '{"a":"' + "x" * 6_000_000 + '"}')
    assert caught.value.code() is grpc.StatusCode.RESOURCE_EXHAUSTED
    assert await client.ask(10001, '{"a":"' + "x" * 4_000_000 + '"}')


async def test_garbage_on_the_socket_disturbs_no_one(door, client) -> None:
    _, writer = await asyncio.open_connection(ADDRESS, door.port)
    writer.write(b"\x00\xff" * 4000)
    await writer.drain()
    assert await client.ask(10001)
    writer.close()


async def test_a_client_that_goes_away_in_the_middle(client, robot) -> None:
    call = client.open(1004, {"motion_id": 101})
    await until(lambda: robot.actions.running())
    call.cancel()
    assert await client.ask(10001)
    assert robot.actions.running()  # the motion goes on


async def test_many_calls_at_once(client) -> None:
    answers = await asyncio.gather(*(client.ask(10001) for _ in range(100)))
    assert len(answers) == 100


async def test_closing_takes_no_second_and_ends_streams(robot, data, pems, messages) -> None:
    took: list[float] = []
    while len(took) < 5 and min(took, default=1.0) >= 1.0:  # a busy machine may take one
        door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0), data)
        await door.start()
        async with pems.channel(door.port) as channel:
            call = Client(channel, messages).open(1004, {"motion_id": 101})
            await until(lambda: robot.actions.running())
            began = time.monotonic()
            await door.close()
            took.append(time.monotonic() - began)
            with pytest.raises((grpc.aio.AioRpcError, asyncio.CancelledError)):
                await call.read()
    assert min(took) < 1.0


async def test_the_start_screen_has_a_line_to_try(door) -> None:
    (endpoint,) = door.endpoints
    assert endpoint.address == f"{ADDRESS}:{door.port}"
    assert "-authority cyberdog2.server" in endpoint.try_line


async def test_line_to_try_holds_in_folder_with_spaces(robot: Robot, tmp_path: Path) -> None:
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0), tmp_path / "our robots")
    (endpoint,) = door.endpoints
    words = shlex.split(endpoint.try_line)
    assert words[words.index("-key") + 1] == str(tmp_path / "our robots/cyberdog/tls/client-key.pem")
    assert words[words.index("-d") + 1] == '{"nameCode": 10001, "params": "{}"}'


def test_rows_are_done_or_said_to_be_partial() -> None:
    rows = {row.key for row in contract("cyberdog")}
    assert implemented() <= rows
    assert not implemented() & partly().keys()
    assert implemented() | partly().keys() == rows
