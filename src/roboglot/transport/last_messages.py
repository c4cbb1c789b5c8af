"""The last message of a gRPC stream and its status, in one write to the socket. Knows no calls.

A streaming handler of ``grpc.aio`` writes its messages, and when it returns, gRPC sends the status: two batches, and
after each a wake-up of gRPC's thread, of the loop and of the client. Most streams have one message. Sent with its
status, as gRPC itself does in a call without a stream, a bare echo takes about a tenth less processor time; the frames
on the wire are the same.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import AbstractContextManager
from inspect import signature
from typing import Protocol, TypeVar

import grpc
from grpc._cython import cygrpc

from roboglot.values import dataclass

log = logging.getLogger(__name__)
# gRPC's own ends of a call; another version may lack them, or take other parameters.
_STREAM, _UNARY = "_finish_handler_with_stream_responses", "_finish_handler_with_unary_response"
_TAKES = {
    _STREAM: ["rpc_state", "stream_handler", "request", "servicer_context", "loop"],
    _UNARY: ["rpc_state", "unary_handler", "request", "servicer_context", "response_serializer", "loop"],
}
R = TypeVar("R", contravariant=True)
M = TypeVar("M")
Handler = Callable[[R, grpc.aio.ServicerContext], Coroutine[object, object, None]]


async def _nothing(*_: object) -> None:
    """Send nothing further."""


_end_stream, _end_call = (getattr(cygrpc, name, _nothing) for name in _TAKES)


class Answers(Protocol[R]):
    """A call's handler: it writes its messages but the last, which it returns; None: there is none to send."""

    def __call__(self, request: R, rpc: grpc.aio.ServicerContext, /) -> Awaitable[object]: ...


@dataclass(frozen=True, slots=True)
class _Ended:
    """A streaming handler's inner handler, its message encoding, and the context held while sending the last one."""

    answers: Callable[..., Awaitable[object]]
    encode: Callable[..., bytes]
    holding: Callable[[], AbstractContextManager[None]]


def ending_with_last(
    answers: Answers[R], encode: Callable[[M], bytes], holding: Callable[[], AbstractContextManager[None]]
) -> Handler[R]:
    """Return a handler of a call with a stream of answers that sends the last message together with the status."""

    async def answer(request: R, rpc: grpc.aio.ServicerContext) -> None:
        """Send the last message before the status; only a gRPC that ends its calls in another way calls this."""
        last = await answers(request, rpc)
        if last is not None:
            with holding():
                await rpc.write(last)

    vars(answer)["ended"] = _Ended(answers, encode, holding)
    if [list(signature(end).parameters) for end in (_end_stream, _end_call)] == list(_TAKES.values()):
        setattr(cygrpc, _STREAM, _end)
    return answer


async def _end(
    state: object, handler: Handler[object], request: object, rpc: grpc.aio.ServicerContext, loop: object
) -> None:
    """Run a streaming handler and end its call; gRPC calls it in place of its own function."""
    ended: _Ended | None = getattr(handler, "ended", None)
    try:
        if ended is None:
            await _end_stream(state, handler, request, rpc, loop)
        else:
            await _end_together(state, ended, request, rpc, loop)
    except cygrpc.ExecuteBatchError:
        log.debug("%s left before its answer was sent", rpc.peer())


async def _end_together(
    state: object, ended: _Ended, request: object, rpc: grpc.aio.ServicerContext, loop: object
) -> None:
    last = await ended.answers(request, rpc)
    if last is None:
        await _end_stream(state, _nothing, request, rpc, loop)
        return

    async def said(*_: object) -> object:
        return last

    with ended.holding():
        await _end_call(state, said, request, rpc, ended.encode, loop)
