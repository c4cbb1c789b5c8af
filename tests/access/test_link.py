"""The tunnel's frames and streams, in pieces of any size."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.access.tunnel import heartbeat
from roboglot.access.tunnel.busy_poll import AWAKE, SHORT_MAX, BusyPoll
from roboglot.access.tunnel.frames import BadFrame, FrameKind, encode
from roboglot.access.tunnel.link import TunnelLink
from roboglot.access.tunnel.tunnel import Tunnel

STILL_FOR = 30  # answers on one connection while nothing moves on the other
FRAMES = st.lists(
    st.tuples(st.sampled_from(FrameKind), st.integers(0, 2**32 - 1), st.binary(max_size=300)), max_size=20
)


@given(FRAMES, st.lists(st.integers(1, 200), max_size=20))
def test_frames_arrive_whole_however_they_are_cut(frames: list[tuple[FrameKind, int, bytes]], cuts: list[int]) -> None:
    async def check() -> None:
        link, seen = TunnelLink(), list[tuple[FrameKind, int, bytes]]()
        link.follow(lambda *frame: seen.append(frame), lambda _crowded: None)
        data = b"".join(encode(*frame) for frame in frames)
        for size in cuts:
            link._cut(data[:size])
            data = data[size:]
        link._cut(data)
        assert seen == frames

    asyncio.run(check())


@given(st.binary(min_size=7, max_size=300))
def test_no_frame_is_refused_at_its_first_byte(data: bytes) -> None:
    async def check() -> None:
        link = TunnelLink()
        link.follow(lambda *_frame: None, lambda _crowded: None)
        if data[0] not in set(FrameKind):
            with pytest.raises(BadFrame):
                link._cut(data)

    asyncio.run(check())


@contextlib.asynccontextmanager
async def tunnels(port: int, drives: Callable[[], bool] = lambda: False) -> AsyncIterator[Tunnel]:
    """Two ends on a connection; what the first carries comes out as connections to ``port``."""
    loop = asyncio.get_running_loop()
    made: asyncio.Future[TunnelLink] = loop.create_future()

    def accepted() -> TunnelLink:
        made.set_result(link := TunnelLink())
        return link

    server = await loop.create_server(accepted, "127.0.0.1", 0)
    _, near = await loop.create_connection(TunnelLink, *server.sockets[0].getsockname())

    async def opened(_: int, protocol: Callable[[], asyncio.Protocol]) -> object:
        return await loop.create_connection(protocol, "127.0.0.1", port)

    far = Tunnel(await made, first=2, opened=opened, datagram=lambda *_: None, drives=drives)
    own = Tunnel(near, first=1, opened=opened, datagram=lambda *_: None)
    running = [asyncio.ensure_future(tunnel.run()) for tunnel in (far, own)]
    yield own
    near.end("the test is over")
    await asyncio.gather(*running, return_exceptions=True)
    server.close()


async def test_a_half_closed_connection_is_answered() -> None:
    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"you said " + await reader.read())  # until the client has ended
        writer.close()

    server = await asyncio.start_server(answer, "127.0.0.1", 0)
    async with tunnels(server.sockets[0].getsockname()[1]) as tunnel, asyncio.timeout(60.0):
        local = await asyncio.get_running_loop().create_server(tunnel.accept(1), "127.0.0.1", 0)
        reader, writer = await asyncio.open_connection(*local.sockets[0].getsockname())
        writer.write(b"hello")
        writer.write_eof()
        assert await reader.read() == b"you said hello"
        writer.close()
        local.close()
    server.close()


async def test_reader_that_rests_holds_up_the_sender_alone() -> None:
    sent = 0

    async def pour(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal sent
        with contextlib.suppress(ConnectionError):
            if await reader.readexactly(1) == b"?":
                writer.write(b"!")
            else:
                while True:
                    writer.write(bytes(10_000))
                    await writer.drain()
                    sent += 10_000
        writer.close()

    server = await asyncio.start_server(pour, "127.0.0.1", 0)
    async with tunnels(server.sockets[0].getsockname()[1]) as tunnel, asyncio.timeout(60.0):
        local = await asyncio.get_running_loop().create_server(tunnel.accept(1), "127.0.0.1", 0)
        where = local.sockets[0].getsockname()
        _, lazy = await asyncio.open_connection(*where, limit=1024)
        lazy.write(b"x")
        still = 0
        while still < STILL_FOR:  # answers come all the while; in the end the lazy reader's peer accepts no more
            before = sent
            reader, writer = await asyncio.open_connection(*where)
            writer.write(b"?")
            assert await reader.read() == b"!"
            writer.close()
            still = still + 1 if sent == before > 0 else 0
        assert sent < 32_000_000  # windows and kernel buffers on the way
        lazy.transport.abort()
        local.close()
    server.close()


async def test_both_ends_beat_often_while_the_client_drives(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(heartbeat, "PING_PERIOD", 1000.0)
    loop = asyncio.get_running_loop()
    drives = False
    asked = asyncio.Event()

    def driven() -> bool:
        asked.set()
        return drives

    async with tunnels(0, drives=driven) as own, asyncio.timeout(60.0):
        sent: list[bytes] = []
        monkeypatch.setattr(own._link, "send", lambda *frame: sent.append(frame[-1]))
        await asked.wait()
        assert loop.time() >= own._heart.quick_until
        drives = True
        while len(sent) < 3:  # noqa: ASYNC110 - this end answers in kind
            await asyncio.sleep(0)
        assert own._heart.quick_until > loop.time()
        assert not any(sent), "only the end that knows who drives asks for it"


async def test_loop_stays_awake_for_moment_after_short_message(monkeypatch: pytest.MonkeyPatch) -> None:
    now, looks = 0.0, 0

    def time_passes() -> float:
        nonlocal now, looks
        now, looks = now + AWAKE / 10, looks + 1
        return now

    monkeypatch.setattr("roboglot.access.tunnel.busy_poll.time", SimpleNamespace(perf_counter=time_passes))
    poll = BusyPoll()
    poll.stir(SHORT_MAX + 1)
    assert not looks
    poll.stir(SHORT_MAX)
    for _ in range(30):
        await asyncio.sleep(0)
    assert 10 <= looks <= 12  # then it sleeps again
