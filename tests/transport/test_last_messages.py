"""Test that a stream's last message and status come as they should, together or one after the other."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, nullcontext

import grpc
import pytest
from grpc._cython import cygrpc

from roboglot.testing.addresses import free_addresses
from roboglot.transport import last_messages
from roboglot.transport.last_messages import ending_with_last

ADDRESS = free_addresses(1)
Ask = Callable[[bytes], grpc.aio.UnaryStreamCall]


async def _answers(request: bytes, rpc: grpc.aio.ServicerContext) -> bytes | None:
    """Write all words but the last; "-" stands for no last word."""
    *before, last = request.split()
    for word in before:
        if word == b"abort":
            await rpc.abort(grpc.StatusCode.ABORTED, "as asked")
        if word == b"wait":
            await asyncio.Event().wait()
        await rpc.write(word)
    return None if last == b"-" else last


@asynccontextmanager
async def _served(holding: Callable[[], object] = nullcontext) -> AsyncIterator[Ask]:
    async def plain(request: bytes, rpc: grpc.aio.ServicerContext) -> None:
        await rpc.write(request)

    handler = ending_with_last(_answers, bytes, holding)  # type: ignore[arg-type]
    methods = {
        name: grpc.unary_stream_rpc_method_handler(method) for name, method in (("ask", handler), ("plain", plain))
    }
    server = grpc.aio.server()
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("words", methods),))
    port = server.add_insecure_port(f"{ADDRESS}:0")
    await server.start()
    async with grpc.aio.insecure_channel(f"{ADDRESS}:{port}") as channel:
        assert [word async for word in channel.unary_stream("/words/plain")(b"as ever")] == [b"as ever"]
        yield channel.unary_stream("/words/ask")
    await server.stop(None)


@pytest.fixture(params=["together", "apart"])
def ended(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """gRPC as it is, and one whose functions are not those known."""
    if request.param == "apart":
        monkeypatch.setattr(cygrpc, last_messages._STREAM, last_messages._end_stream)
        monkeypatch.setattr(last_messages, "_end_call", lambda *_: None)
    return str(request.param)


@pytest.mark.usefixtures("ended")
@pytest.mark.parametrize("words", [b"one", b"one two", b"one two three", b"one -", b"-"])
async def test_all_messages_come_then_the_status(words: bytes) -> None:
    async with _served() as ask:
        call = ask(words)
        assert [word async for word in call] == [word for word in words.split() if word != b"-"]
        assert await call.code() is grpc.StatusCode.OK


async def test_sending_the_last_one_is_held(ended: str) -> None:
    held, changes = False, list[bool]()

    @contextmanager
    def holding() -> Iterator[None]:
        nonlocal held
        changes.append(held := True)
        yield
        changes.append(held := False)

    async with _served(holding) as ask:
        assert [word async for word in ask(b"one two")] == [b"one", b"two"]
        assert [word async for word in ask(b"one -")] == [b"one"]
    assert changes == [True, False]


@pytest.mark.usefixtures("ended")
async def test_aborted_call_sends_no_last_message() -> None:
    async with _served() as ask:
        call = ask(b"one abort two")
        with pytest.raises(grpc.aio.AioRpcError, match="as asked"):
            _ = [word async for word in call]
        assert await call.code() is grpc.StatusCode.ABORTED


@pytest.mark.usefixtures("ended")
async def test_client_that_leaves_ends_the_handler() -> None:
    async with _served() as ask:
        call = ask(b"one wait two")
        assert await call.read() == b"one"
        call.cancel()
        assert [word async for word in ask(b"still there")] == [b"still", b"there"]


async def test_client_gone_before_the_status_is_no_error(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    ended = asyncio.Event()

    async def gone(*_: object) -> None:
        ended.set()
        raise cygrpc.ExecuteBatchError("SendStatusFromServerOperation")

    monkeypatch.setattr(last_messages, "_end_call", gone)
    async with _served() as ask:
        call = ask(b"one")
        await ended.wait()
        call.cancel()
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


def test_this_grpc_sends_both_together() -> None:
    ending_with_last(_answers, bytes, nullcontext)
    assert getattr(cygrpc, last_messages._STREAM) is last_messages._end
