"""Chapter "photo and video": files in chunks, what a broken transfer leaves, what a lost app leaves."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import io
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import av
import grpc
import pytest
from PIL import Image

from roboglot.media.recorder import Recorder
from roboglot.media.stills import jpeg
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.system.disk import Disk
from roboglot.protocols.cyberdog import service
from roboglot.protocols.cyberdog.chapters.camera import camera_files, transfers
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from tests.protocols.cyberdog.phone import ADDRESS, PATIENCE, App, Client, until

pytestmark = pytest.mark.world("playground", body="cyberdog2")


@pytest.fixture(autouse=True)
def folder(data: Path):
    """Yield the robot's folder for its files; empty before and after."""
    kept = data / "cyberdog" / "camera" / "a"
    _clear(kept)
    yield kept
    _clear(kept)


def _clear(folder: Path) -> None:
    for path in folder.glob("*"):
        path.unlink()


async def test_photo_comes_whole_and_is_gone_from_robot(client: Client, robot, folder) -> None:
    (chunk,) = await client.file(4002, {"command": 1})
    assert chunk.error_code == 0
    assert chunk.file_size == len(chunk.buffer)
    assert chunk.file_name.endswith(".jpg")
    assert Image.open(io.BytesIO(chunk.buffer)).size == (1280, 720)
    assert list(folder.iterdir()) == []
    assert not [use for use in robot[Disk].uses if use.startswith("camera")]


async def test_photos_of_the_same_second_have_own_names(client: Client) -> None:
    names = [(await client.file(4002, {"command": 1}))[0].file_name for _ in range(3)]
    assert len(set(names)) == 3


async def test_large_files_come_in_chunks(client, robot, folder, monkeypatch) -> None:
    monkeypatch.setattr(transfers, "CHUNK", 10_000)
    chunks = await client.file(4002, {"command": 1})
    assert len(chunks) > 2
    assert len({(chunk.file_name, chunk.file_size) for chunk in chunks}) == 1
    whole = b"".join(chunk.buffer for chunk in chunks)
    assert len(whole) == chunks[0].file_size
    assert Image.open(io.BytesIO(whole)).format == "JPEG"


@pytest.mark.slow  # in short: test_photo_comes_whole_and_is_gone_from_robot
async def test_a_recording_is_an_mp4_of_its_length(client, robot, forward, folder, passing) -> None:
    assert await client.ask(4002, {"command": 2}) == {"result": 0}
    assert await client.ask(4002, {"command": 2}) == {"result": 4}
    await forward(seconds=2)
    chunks = await client.file(4002, {"command": 3})
    assert chunks[0].error_code == 0
    assert chunks[0].file_name.endswith(".mp4")
    with av.open(io.BytesIO(b"".join(chunk.buffer for chunk in chunks))) as video:
        assert 50 <= sum(1 for _ in video.decode(video=0)) <= 62  # type: ignore[misc, union-attr]
    await passing(lambda: list(folder.iterdir()) == [])


async def test_refusals_come_as_a_chunk(client, robot) -> None:
    for code, params, error in (
        (4002, {"command": 3}, 5),  # nothing is recorded
        (4002, {"command": 9}, 1),
        (4002, {}, 1),
        (4002, {"command": True}, 1),
        (4004, {"file_name": "20260101_000000.jpg"}, 9),
        (4004, {"file_name": "../../tls/client-key.pem"}, 9),
        (4004, {"file_name": 7}, 9),
        (1001, {}, 255),
    ):
        assert [chunk.error_code for chunk in await client.file(code, params)] == [error]
    assert await client.ask(4002, {"command": 3}) == {"result": 5}
    assert await client.ask(4002, {"command": 9}) == {"result": 1}
    assert await client.ask(4002, {}) == {"error_code": 323}
    assert await client.ask(4002, {"command": 3}) == {"result": 5}  # it began no recording


async def test_unfetched_files_are_offered_again(client, app: App, robot, folder, passing) -> None:
    assert await client.ask(4002, {"command": 1}) == {"result": 0}
    assert await client.ask(4002, {"command": 1}) == {"result": 0}
    names = sorted(path.name for path in folder.iterdir())
    assert len(names) == 2
    await passing(lambda: app.of(4003))
    assert app.of(4003) == [{"file_name": names}]
    for name in names:
        (chunk,) = await client.file(4004, {"file_name": name})
        assert chunk.file_name == name
        assert Image.open(io.BytesIO(chunk.buffer)).size == (1280, 720)
    await passing(lambda: list(folder.iterdir()) == [])


async def test_a_broken_transfer_loses_nothing(client, robot, folder, monkeypatch) -> None:
    monkeypatch.setattr(transfers, "CHUNK", 100)
    call = client.fetch(4002, {"command": 1})
    assert (await call.read()).error_code == 0
    call.cancel()
    (name,) = [path.name for path in folder.iterdir()]
    monkeypatch.setattr(transfers, "CHUNK", 4_000_000)
    (chunk,) = await client.file(4004, {"file_name": name})
    assert len(chunk.buffer) == chunk.file_size


@pytest.mark.slow  # in short: test_a_broken_transfer_loses_nothing
async def test_file_swallowed_after_the_last_byte_is_kept(
    client, app, door, pems, messages, folder, passing, monkeypatch
) -> None:
    """The client's window takes a small file whole: the robot has sent it, and nothing has arrived."""
    monkeypatch.setattr(camera_files, "jpeg", lambda frame: jpeg(frame, 5))
    await client.ask(10001)
    await passing(lambda: app.connected)
    stalled = Stalling(ADDRESS, door.port)
    async with stalled.open() as port, pems.channel(port, address="127.0.0.1") as channel:
        call = Client(channel, messages)
        await call.ask(10001)
        stalled.stall()
        fetching = asyncio.ensure_future(call.file(4002, {"command": 1}))
        await passing(lambda: list(folder.glob("*.jpg")))
        app.silent = True  # that network is down both ways
        await asyncio.sleep(0.05)
        stalled.cut()
        with pytest.raises(grpc.aio.AioRpcError):
            await fetching
        seen = len(app.ticks)
        await passing(lambda: not door._context.app.connected)
        app.silent = False
        await client.ask(10001)
        await passing(lambda: len(app.ticks) > seen)
        await passing(lambda: app.of(4003))
    (name,) = app.of(4003)[0]["file_name"]
    (chunk,) = await client.file(4004, {"file_name": name})
    assert len(chunk.buffer) == chunk.file_size < 60_000
    await passing(lambda: list(folder.iterdir()) == [])


class Stalling:
    """A network between app and robot that takes bytes and brings them nowhere."""

    def __init__(self, host: str, port: int) -> None:
        self._to = host, port
        self._flows = asyncio.Event()
        self._flows.set()
        self._writers: list[asyncio.StreamWriter] = []

    @asynccontextmanager
    async def open(self) -> AsyncIterator[int]:
        server = await asyncio.start_server(self._join, "127.0.0.1", 0)
        try:
            yield server.sockets[0].getsockname()[1]
        finally:
            server.close()
            self.cut()

    def stall(self) -> None:
        self._flows.clear()

    def cut(self) -> None:
        for writer in self._writers:
            writer.transport.abort()
        self._flows.set()

    async def _join(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        far_reader, far_writer = await asyncio.open_connection(*self._to)
        self._writers += [writer, far_writer]
        await asyncio.gather(self._pass(reader, far_writer, always=True), self._pass(far_reader, writer))

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, always: bool = False) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(65536):
                if not always:
                    await self._flows.wait()
                writer.write(data)
                await writer.drain()


@pytest.mark.slow
async def test_lost_app_ends_the_recording_and_keeps_it(client, app, robot, folder, passing, forward) -> None:
    robot[Camera].rate = 5.0  # six seconds of film in a sixth of the pictures
    await client.ask(4002, {"command": 2})
    await passing(lambda: app.connected)
    await forward(seconds=1)
    app.silent = True
    await passing(lambda: not robot[Recorder].recording)
    await until(lambda: list(folder.glob("*.mp4")))
    app.silent = False
    await client.ask(10001)
    await passing(lambda: app.of(4003))
    assert app.of(4003)[0]["file_name"] == [path.name for path in folder.iterdir()]


async def test_files_count_on_disk_and_survive_a_restart(client, app, robot, folder, passing) -> None:
    await client.ask(4002, {"command": 1})
    (path,) = folder.iterdir()
    assert robot[Disk].uses[f"camera {path.name}"] == path.stat().st_size
    await passing(lambda: app.connected)
    robot[Disk].release(f"camera {path.name}")
    assert CameraFiles(robot, folder).names() == [path.name]
    assert f"camera {path.name}" in robot[Disk].uses


async def test_full_disk_is_reported_and_takes_no_picture(client, app, robot, folder, passing) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    robot[Disk].take("rubbish", robot[Disk].free - 400_000_000)
    await passing(lambda: app.of(4005))
    assert app.of(4005) == [{"remain_size": 400_000_000}]
    robot[Disk].take("rubbish", robot[Disk].uses["rubbish"] + robot[Disk].free)
    assert [chunk.error_code for chunk in await client.file(4002, {"command": 1})] == [5]
    assert list(folder.iterdir() if folder.is_dir() else []) == []


async def test_more_than_six_at_once_are_refused(client, robot, folder, monkeypatch) -> None:
    monkeypatch.setattr(transfers, "CHUNK", 10)
    calls = [client.fetch(4002, {"command": 1}) for _ in range(6)]
    await asyncio.gather(*(call.read() for call in calls))
    assert [chunk.error_code for chunk in await client.file(4002, {"command": 1})] == [10]
    for call in calls:
        call.cancel()


async def read_to_end(call: grpc.aio.UnaryStreamCall) -> None:
    while await call.read() is not grpc.aio.EOF:
        pass


@pytest.mark.parametrize("leaves", [True, False])
async def test_files_nobody_reads_leave_room_for_others(
    client, robot, folder, pems, messages, door, monkeypatch, caplog, leaves
) -> None:
    """gRPC takes up to some 16 MB for a client that reads nothing, and then no more.

    A client that reads on later gets the status: one that was set during the last chunk's write often never came.
    """
    monkeypatch.setattr(transfers, "HOST_TRANSFERS_MAX", 1)
    monkeypatch.setattr(service, "CHUNK_SECONDS_MAX", 0.1)
    monkeypatch.setattr(service, "WRITE_MAX", 0.05)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "large.jpg").write_bytes(bytes(48_000_000))
    hung = client.fetch(4004, {"file_name": "large.jpg"})
    assert (await hung.read()).error_code == 0
    async with pems.channel(door.port) as channel:
        other = Client(channel, messages)
        answers = list[int]()
        async with asyncio.timeout(PATIENCE):
            while answers != [0]:
                with contextlib.suppress(grpc.aio.AioRpcError):  # too slow, on a busy machine
                    answers = [chunk.error_code for chunk in await other.file(4002, {"command": 1})]
        if leaves:
            hung.cancel()
        else:  # the file is incomplete, and the status says so
            with pytest.raises(grpc.aio.AioRpcError, match="DEADLINE_EXCEEDED"):
                await asyncio.wait_for(read_to_end(hung), PATIENCE)
        await until(lambda: not door._calls._open)
        gc.collect()
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


async def test_files_of_one_host_leave_room_for_others(client, door, monkeypatch) -> None:
    async def never() -> Path:
        await asyncio.Event().wait()
        raise AssertionError

    sending = door._context.transfers
    monkeypatch.setattr(transfers, "TRANSFERS_MAX", transfers.HOST_TRANSFERS_MAX + 1)
    waiting = [asyncio.ensure_future(anext(sending.send("a", never))) for _ in range(transfers.HOST_TRANSFERS_MAX)]
    await asyncio.sleep(0)
    assert (await anext(sending.send("a", never))).error_code == 10
    waiting.append(asyncio.ensure_future(anext(sending.send("b", never))))
    await asyncio.sleep(0)
    assert not waiting[-1].done()
    assert (await anext(sending.send("c", never))).error_code == 10
    for call in waiting:
        call.cancel()
    await asyncio.gather(*waiting, return_exceptions=True)
    assert not sending._under_way
