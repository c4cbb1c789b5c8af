"""One connection from a robot to an app, with one-word outcomes of its calls. Knows no robot."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterable, Callable, Coroutine

import grpc

from roboglot.protocols.cyberdog.frame_queue import Delivery
from roboglot.transport.wakes import prompt_wakes
from roboglot.wire.cyberdog.channel import APP_NAME, client_options
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto.cyberdog_app_pb2_grpc import GrpcAppStub

log = logging.getLogger(__name__)
DONE, CLOSED, UNUSABLE = "ok", "closed", "unusable"  # outcomes besides the names of gRPC statuses
BROKEN = frozenset({"unavailable", "cancelled", CLOSED, UNUSABLE})
Credentials = Callable[[], grpc.ChannelCredentials] | None


class AppLine:
    """A connection to an app; the first call connects."""

    def __init__(self, target: str, credentials: Credentials) -> None:
        self._target, self._credentials = target, credentials
        self._channel: grpc.aio.Channel | None = None
        self._stub: GrpcAppStub | None = None  # of the channel; to make one takes 10 to 30 µs

    async def heartbeat(self, ticks: pb.Ticks) -> str:
        """Send a heartbeat with the robot's state."""
        stub = self._stub or self._connect()
        return await self._outcome(_one(stub.heartbeat(ticks)), "heartbeat")

    async def push(self, code: int, text: str) -> str:
        """Send one message; return once it is acknowledged."""
        stub = self._stub or self._connect()
        return await self._outcome(_read_to_the_end(stub.sendMsg(pb.SendRequest(nameCode=code, params=text))), code)

    async def close(self) -> str:
        """Close the connection."""
        if self._channel is not None:
            await self._channel.close()
        return DONE

    def _connect(self) -> GrpcAppStub:
        options = client_options(APP_NAME)
        with prompt_wakes():
            if self._credentials is None:
                self._channel = grpc.aio.insecure_channel(self._target, options=options)
            else:
                self._channel = grpc.aio.secure_channel(self._target, self._credentials(), options=options)
        self._stub = GrpcAppStub(self._channel)
        return self._stub

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


async def _read_to_the_end(call: AsyncIterable[object]) -> None:
    """Read the app's answers and ignore them, as real robots do."""
    async for _ in call:
        pass
