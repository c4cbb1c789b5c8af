"""Hostile or broken apps are refused in the protocol's form, and cost bounded memory."""

from __future__ import annotations

import asyncio
import contextlib
import json
from pathlib import Path
from typing import Any

import grpc
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.dispatch import KNOWN, answer
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.testing.addresses import free_addresses
from roboglot.testing.process import ServedRobot, served
from roboglot.wire.cyberdog.channel import MESSAGE_MAX
from roboglot.wire.cyberdog.text import NotJson, read_params, write
from tests.protocols.cyberdog.phone import PATIENCE, Client, Messages, Pems, until

STREAMS = 10_000
GROWTH_MAX = 150.0  # MB
LONELY = free_addresses(1)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=12), inner, max_size=4),
    max_leaves=12,
)


@given(st.text() | st.binary().map(lambda raw: raw.decode("latin1")) | json_values.map(json.dumps))
def test_any_text_is_params_or_no_json(text: str) -> None:
    try:
        values = read_params(text)
    except NotJson:
        return
    assert isinstance(dict(values), dict)


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"a":' * 100_000, "1" * 5000 + "\n", "[" * 100_000 + "\n", "NaN\n", ""]
)
def test_depth_and_length_break_nothing(text: str) -> None:
    try:
        assert isinstance(dict(read_params(text)), dict)
    except NotJson:
        return


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_requests_of_any_shape_are_answered(data: st.DataObject, dog_of_no_robot: Any, caplog: Any) -> None:
    """Any content of the fields gets an answer or an in-band error; no handler raises."""
    code = data.draw(st.sampled_from(sorted(KNOWN)))
    fields = data.draw(st.dictionaries(st.sampled_from(_names(code)) | st.text(max_size=5), json_values, max_size=6))

    async def ask() -> object:
        async def reply(value: object) -> None:
            write(value)

        return await answer(Call(code, json.dumps(fields), dog_of_no_robot, reply))

    last = asyncio.run(asyncio.wait_for(ask(), PATIENCE))
    assert last is None or json.loads(write(last) or "{}") is not None
    assert " crashed" not in caplog.text


@pytest.fixture
def dog_of_no_robot() -> Any:
    """Everything is missing: what a handler does before it looks for a part."""
    from roboglot.model.clock import LockstepClock
    from roboglot.model.robot import Description, Robot
    from roboglot.protocols.cyberdog.chapters.mapping.task_state import Tasks
    from roboglot.protocols.cyberdog.chapters.motion.gait import Gaits

    plate = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.1, height=0.1)

    class Silent:
        connected = False

        def push(self, *_: object) -> None:
            """Send nothing."""

        def forget(self) -> None:
            """Do nothing: no robot is known."""

    known = Robot("a", plate, LockstepClock())

    class Context:
        robot, gaits = known, Gaits(known)
        app, tasks, stored_map, pursuit, relay, address, files = Silent(), Tasks(), "", None, None, "", None

    return Context()


def _names(code: int) -> list[str]:
    from roboglot.protocols.cyberdog.table import TABLE

    operation = TABLE.get(code)
    return list(operation.names) if operation and operation.names else ["x"]


@pytest.mark.world("empty")
async def test_messages_that_are_too_long(client: Client) -> None:
    call = client.open(10001, '"' + "x" * MESSAGE_MAX + '"')
    with pytest.raises(grpc.aio.AioRpcError) as refused:
        await call.read()
    assert refused.value.code() is grpc.StatusCode.RESOURCE_EXHAUSTED
    assert await client.raw(10001, "[1]")  # the connection survives
    assert await client.raw(10001, "x" * 1_000_000) == [(0, '{"error_code":323}')]


@pytest.mark.world("empty")
async def test_one_host_leaves_calls_to_others(
    door: CyberDogDoor, client: Client, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(door._calls, "most", 1)
    slow = client.open(1004, {"motion_id": 101})
    await until(lambda: robot.actions.running())
    for attempt in (client.raw(10001), client.file(4003)):
        with pytest.raises(grpc.aio.AioRpcError) as refused:
            await attempt
        assert refused.value.code() is grpc.StatusCode.RESOURCE_EXHAUSTED
    slow.cancel()
    answers: list[tuple[int, str]] = []
    async with asyncio.timeout(PATIENCE):
        while not answers:  # until the door has heard of it
            with contextlib.suppress(grpc.aio.AioRpcError):
                answers = await client.raw(10001)


async def _idle(robot: ServedRobot) -> None:
    for _ in range(40):
        before = robot.cpu_seconds
        await asyncio.sleep(0.25)
        if robot.cpu_seconds - before < 0.05:
            return


@pytest.mark.slow  # a load test
async def test_ten_thousand_streams_at_robot_of_its_own(tmp_path: Path, messages: Messages) -> None:
    """All request something slow: some wait in line, and other apps still get answers."""
    arguments = ("--robot", "a=cyberdog2", "--world", "empty")
    with served(tmp_path / "data", *arguments, address=LONELY) as robot:
        tls = tmp_path / "data" / "cyberdog" / "tls"
        pems = Pems(*((tls / f"{name}.pem").read_bytes() for name in ("ca-cert", "client-cert", "client-key")))
        async with pems.channel(50052, address=LONELY) as channel, pems.channel(50052, address=LONELY) as other:
            app, hostile = Client(other, messages), Client(channel, messages)
            assert await app.raw(10001)
            await _idle(robot)  # kernels are loaded before: they are no growth
            before = robot.resident_megabytes
            calls = [hostile.open(8001, {"scan_seconds": 15.0}) for _ in range(STREAMS)]
            assert await app.raw(10001)
            for call in calls:
                call.cancel()
            assert await app.raw(10001)
            assert robot.resident_megabytes - before < GROWTH_MAX


@pytest.mark.world("empty")
async def test_certificates_of_another_ca(door, pems: Pems, tmp_path, messages) -> None:
    from roboglot.protocols.cyberdog.certificates import export_client

    paths = export_client(tmp_path / "other", tmp_path / "phone")
    stranger = Pems(*(path.read_bytes() for path in paths))
    for proof in (stranger, Pems(pems.ca, stranger.certificate, stranger.key)):
        async with proof.channel(door.port) as channel:
            with pytest.raises(grpc.aio.AioRpcError) as refused:
                await Client(channel, messages).raw(10001)
            assert refused.value.code() is grpc.StatusCode.UNAVAILABLE
