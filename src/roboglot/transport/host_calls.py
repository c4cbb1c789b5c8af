"""A limit of one host's open calls at a gRPC server, from a call's first frame to its last. Knows no messages.

gRPC bounds the calls of all clients together, and counts those whose request never arrives and those whose last answer
is never read, too. A handler runs between these two, so it cannot count for its host what would lock out all others.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Coroutine
from inspect import signature

import grpc
from grpc._cython import cygrpc

# gRPC's own function for a call with one request and a stream of answers; another version may take other parameters.
_CALL, _TAKES = "_handle_unary_stream_rpc", ["method_handler", "rpc_state", "loop"]
_serve = getattr(cygrpc, _CALL, None)
Handler = Callable[..., Coroutine[object, object, object]]


class HostCalls:
    """Open calls by host; ``host_of`` reads the host from a peer's name. A call beyond ``most`` is refused."""

    def __init__(self, host_of: Callable[[str], str], most: int) -> None:
        self.most, self._host_of = most, host_of
        self._open: dict[str, int] = {}

    def limiting(self, handler: Handler) -> Handler:
        """Return a handler whose calls count; with a gRPC that serves them in another way, they do not."""

        @functools.wraps(handler)
        async def answer(request: object, rpc: grpc.aio.ServicerContext) -> None:
            await handler(request, rpc)

        vars(answer)["host_calls"] = self
        if _serve is not None and list(signature(_serve).parameters) == _TAKES:
            setattr(cygrpc, _CALL, _counted)
        return answer

    async def serve(self, handler: object, state: object, loop: object) -> None:
        """Count a call while gRPC serves it."""
        rpc = cygrpc._ServicerContext(state, None, None, loop)
        host = self._host_of(rpc.peer())
        count = self._open[host] = self._open.get(host, 0) + 1
        try:
            if count > self.most:
                reason = f"a host has at most {self.most} calls at the same time"
                await rpc.abort(grpc.StatusCode.RESOURCE_EXHAUSTED, reason)
            assert _serve is not None
            await _serve(handler, state, loop)
        finally:
            self._open[host] -= 1
            if not self._open[host]:
                del self._open[host]


async def _counted(handler: grpc.RpcMethodHandler, state: object, loop: object) -> None:
    """Serve a call; gRPC calls it in place of its own function."""
    calls: HostCalls | None = getattr(handler.unary_stream, "host_calls", None)
    if calls is not None:
        await calls.serve(handler, state, loop)
    elif _serve is not None:
        await _serve(handler, state, loop)
