"""One connection from a robot to an app, with one-word outcomes of its calls. Knows no robot."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine

import grpc

from roboglot.protocols.cyberdog.frame_queue import Delivery
from roboglot.transport.grpc_wakeups import prompt_wakeups
from roboglot.wire.cyberdog.channel import APP_NAME, SERVICE, client_options
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

log = logging.getLogger(__name__)
DONE, CLOSED, UNUSABLE = "ok", "closed", "unusable"  # outcomes besides the names of gRPC statuses
ANSWERS_MAX = 16  # to a push
BROKEN = frozenset({"unavailable", "cancelled", CLOSED, UNUSABLE})
_Calls = tuple[grpc.aio.UnaryUnaryMultiCallable, grpc.aio.UnaryStreamMultiCallable]
Credentials = Callable[[], grpc.ChannelCredentials] | None


class AppLine:
    """A connection to an app; the first call connects."""

    def __init__(self, target: str, credentials: Credentials) -> None:
        self._target, self._credentials = target, credentials
        self._channel: grpc.aio.Channel | None = None
        self._calls: _Calls | None = None  # of the channel; to make them takes 10 to 30 µs

    async def heartbeat(self, ticks: pb.Ticks) -> str:
        """Send a heartbeat with the robot's state."""
        beat, _ = self._calls or self._connect()
        return await self._outcome(_one(beat(ticks)), "heartbeat")

    async def push(self, code: int, text: str) -> str:
        """Send one message; return once it is acknowledged."""
        _, send = self._calls or self._connect()
        return await self._outcome(_read_answers(send(pb.SendRequest(nameCode=code, params=text))), code)

    async def close(self) -> str:
        """Close the connection."""
        if self._channel is not None:
            await self._channel.close()
        return DONE

    def _connect(self) -> _Calls:
        options = client_options(APP_NAME)
        with prompt_wakeups():
            if self._credentials is None:
                self._channel = grpc.aio.insecure_channel(self._target, options=options)
            else:
                self._channel = grpc.aio.secure_channel(self._target, self._credentials(), options=options)
        beat, send = f"/{SERVICE}/heartbeat", f"/{SERVICE}/sendMsg"  # answers stay bytes, which no one reads
        self._calls = (
            self._channel.unary_unary(beat, request_serializer=pb.Ticks.SerializeToString),
            self._channel.unary_stream(send, request_serializer=pb.SendRequest.SerializeToString),
        )
        return self._calls

    async def _outcome(self, call: Coroutine[None, None, None], what: object) -> str:
        try:
            await call
        except grpc.aio.AioRpcError as error:
            name: str = error.code().name.lower()
            log.debug("%s to %s failed: %s: %s", what, self._target, name, error.details())
            return name
        except grpc.aio.UsageError as error:
            log.debug("%s to %s failed: %s", what, self._target, error)
            return UNUSABLE
        except asyncio.CancelledError:  # the channel was closed meanwhile, or the task is cancelled
            if (task := asyncio.current_task()) and task.cancelling():
                raise
            log.debug("%s to %s failed: the app was lost", what, self._target)
            return CLOSED
        return DONE


def delivery(outcome: str) -> Delivery:
    """Return the delivery of a push: an error answer proves that it arrived; a broken line leaves it open."""
    return Delivery.FAILED if outcome in BROKEN else Delivery.DONE


async def _one(call: Coroutine[None, None, object]) -> None:
    await call


async def _read_answers(call: grpc.aio.UnaryStreamCall) -> None:
    """Read the app's answers and ignore them, as real robots do; an app that goes on answering is cut off."""
    count = 0
    async for _ in call:
        if (count := count + 1) == ANSWERS_MAX:
            call.cancel()
            return
