"""Robots that send bytes of any kind: each call fails with a ClientError or succeeds, and the log stays short."""

from __future__ import annotations

import asyncio
import json
import logging
import os
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

import grpc
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from roboglot.cli.cyberdog import _receive
from roboglot.clients.cyberdog import CyberDogClient, values
from roboglot.clients.cyberdog.chapters.camera.camera import MEMORY_MAX, PHOTO_MAX
from roboglot.clients.errors import BadAnswer, ClientError
from roboglot.wire.cyberdog.channel import APP_NAME, SERVICE, client_options
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from tests.narrowing import known

ADDRESS = "127.0.0.1"
PATIENCE = 60.0  # real s
NONSENSE = (b"\xff\xff", b"\x12\x02\xff\xfe")  # no protobuf; a text that is no UTF-8


class Robot:
    """Answers every request with the same bytes."""

    def __init__(self) -> None:
        self.answers: Sequence[bytes] = ()
        self._server = grpc.aio.server()
        calls = {name: grpc.unary_stream_rpc_method_handler(self._answer) for name in ("sendMsg", "getFile")}
        self._server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, calls),))
        self.port = self._server.add_insecure_port(f"{ADDRESS}:0")

    async def __aenter__(self) -> Robot:
        await self._server.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._server.stop(None)

    async def _answer(self, _request: bytes, _context: object) -> AsyncIterator[bytes]:
        for answer in self.answers:
            yield answer


def said(text: str) -> bytes:
    return pb.RecResponse(nameCode=Code.STATUS, data=text).SerializeToString()


async def failures(answers: Sequence[bytes]) -> list[ClientError]:
    """Return the errors of the calls of a client to a robot with these answers, one after the other."""
    found = []
    async with Robot() as robot, CyberDogClient(ADDRESS, None, port=robot.port, app_port=None) as client:
        for answer in answers:
            robot.answers = (answer,)
            try:
                async with asyncio.timeout(PATIENCE):
                    await client.do(Code.STATUS)
            except ClientError as error:
                found.append(error)
    return found


async def test_bytes_that_are_no_answer_are_bad_ones(caplog: pytest.LogCaptureFixture) -> None:
    assert [type(error) for error in await failures(NONSENSE)] == [BadAnswer, BadAnswer]
    async with Robot() as robot, CyberDogClient(ADDRESS, None, port=robot.port, app_port=None) as client:
        robot.answers = NONSENSE
        with pytest.raises(BadAnswer):
            _ = [chunk async for chunk in client.link.fetch(Code.STATUS, "{}")]
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def part(data: bytes, size: int) -> bytes:
    return pb.FileChunk(file_name="x.mp4", file_size=size, buffer=data).SerializeToString()


async def test_file_is_held_up_to_a_bound(tmp_path: Path) -> None:
    async with Robot() as robot, CyberDogClient(ADDRESS, None, port=robot.port, app_port=None) as client:
        for fetch, most in ((client.photo, PHOTO_MAX), (client.stop_recording, MEMORY_MAX)):
            for answers in ([part(b"x", most + 1)], [part(b"x", 2), part(b"x", most + 1)]):
                robot.answers = answers
                with pytest.raises(BadAnswer, match="into a file only"):
                    await fetch()
        robot.answers = [part(b"ab", 3), part(b"c", 3)]
        assert (await client.stop_recording()).data == b"abc"
        with (tmp_path / "film").open("wb") as file:
            film = await client.stop_recording(into=file)
        assert (film.data, film.size, (tmp_path / "film").read_bytes()) == (b"", 3, b"abc")


@pytest.mark.parametrize("name", ["mine.mp4", ""])
async def test_file_that_fails_leaves_nothing(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.mp4").write_bytes(b"mine")
    async with Robot() as robot, CyberDogClient(ADDRESS, None, port=robot.port, app_port=None) as client:
        for answers in ([part(b"abcd", 2**32 - 1)], [part(b"abcd", 3)], [part(b"ab", 3), NONSENSE[0]]):
            robot.answers = answers
            with pytest.raises(BadAnswer):
                await _receive(name, lambda file: client.stop_recording(into=file))
            assert os.listdir(tmp_path) == ["mine.mp4"]
            assert (tmp_path / "mine.mp4").read_bytes() == b"mine"
        robot.answers = [part(b"abc", 3)]
        await _receive(name, lambda file: client.stop_recording(into=file))
    assert {*os.listdir(tmp_path)} == {"mine.mp4", name or "x.mp4"}
    assert (tmp_path / (name or "x.mp4")).read_bytes() == b"abc"


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=5), inner, max_size=2),
    max_leaves=4,
)
fields = st.dictionaries(st.sampled_from(("success", "result", "code", "message", "error_code")), anything)


@settings(max_examples=25, deadline=None)
@example(['{"success":false,"code":"x"}', '{"result":[],"code":{}}', '{"success":false,"code":2.0}'])
@given(st.lists(fields.map(json.dumps) | st.text(), max_size=8))
def test_any_text_is_success_or_clients_error(texts: list[str]) -> None:
    asyncio.run(failures([said(text) for text in texts]))


@pytest.mark.parametrize("sent", NONSENSE)
async def test_bytes_that_are_no_push_end_their_call(sent: bytes, caplog: pytest.LogCaptureFixture) -> None:
    async with (
        CyberDogClient(ADDRESS, None, port=1, app_port=0) as client,
        grpc.aio.insecure_channel(f"{ADDRESS}:{client.link.app_port}") as channel,
    ):
        with pytest.raises(grpc.aio.AioRpcError) as refused:
            async with asyncio.timeout(PATIENCE):
                _ = [answer async for answer in channel.unary_stream(f"/{SERVICE}/sendMsg")(sent)]
        assert refused.value.code() is grpc.StatusCode.INTERNAL
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


async def test_calls_of_another_robot_are_refused() -> None:
    """A robot that had this app before remembers its address, and would mix its state and pose into this one's."""
    async with (
        Robot() as robot,
        CyberDogClient(ADDRESS, None, port=robot.port, app_port=0) as client,
        _dial(client) as own,
        _dial(client) as other,
        _dial(client) as silent,
        asyncio.timeout(PATIENCE),
    ):
        robot.answers = (pb.RecResponse(nameCode=Code.DEVICE_INFO, data='{"sn": "mine"}').SerializeToString(),)
        await _beat(other, "other")
        finding = asyncio.ensure_future(client.found())
        while await _beat(other, "other"):
            pass
        assert not finding.done()
        assert await _beat(own, "mine")
        assert (await finding).serial == "mine"
        assert not await _beat(other, "other")
        assert known(client.heartbeat).serial == "mine"
        with client.watch(values.Pose) as poses:
            for stranger in (other, silent):  # one has named another robot, one none
                with pytest.raises(grpc.aio.AioRpcError, match="another robot"):
                    await _push(stranger, 1.0)
            await _push(own, 2.0)
            async for pose in poses:
                assert pose.px == 2.0
                break


def _dial(client: CyberDogClient) -> grpc.aio.Channel:
    where = f"{ADDRESS}:{client.link.app_port}"
    return grpc.aio.insecure_channel(where, options=client_options(APP_NAME))  # a connection of its own


async def _beat(channel: grpc.aio.Channel, serial: str) -> bool:
    """Send a heartbeat; return whether it was taken."""
    try:
        await channel.unary_unary(f"/{SERVICE}/heartbeat")(pb.Ticks(sn=serial, battery_power=50).SerializeToString())
    except grpc.aio.AioRpcError as error:
        if error.code() is not grpc.StatusCode.PERMISSION_DENIED:
            raise
        return False
    return True


async def _push(channel: grpc.aio.Channel, x: float) -> None:
    pose = json.dumps({"px": x, "py": 0.0, "pz": 0.0, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0})
    request = pb.SendRequest(nameCode=Code.POSE, params=pose)
    _ = [answer async for answer in channel.unary_stream(f"/{SERVICE}/sendMsg")(request.SerializeToString())]
