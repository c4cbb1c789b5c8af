"""The three calls of the gRPC service: identifies callers, waits for their turns, and sends answers."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable
from typing import TypeVar
from urllib.parse import unquote

import grpc

from roboglot.model.admission import NO_PROOF, Proof, ProofKind, Right, Unknown
from roboglot.model.client_context import identity, set_client
from roboglot.model.inputs.external import CALLED_OFF
from roboglot.protocols.cyberdog.app_link import host_of
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.camera.camera import get_file
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.dispatch import answer, error
from roboglot.protocols.cyberdog.errors import RecordedEnd
from roboglot.protocols.cyberdog.handshakes import Handshakes
from roboglot.protocols.cyberdog.stops import stops
from roboglot.protocols.turns import wait_for_turn
from roboglot.transport.limiter import pay
from roboglot.wire.cyberdog.channel import MESSAGE_MAX
from roboglot.wire.cyberdog.codes import FileError, InBandError
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.text import NotJson, read_params, write

log = logging.getLogger(__name__)
T = TypeVar("T")
FRAME = 64  # bytes of a message besides its text, with a margin
CHARACTERS_MAX = (MESSAGE_MAX - FRAME) // 4  # that fit into a message, whatever their encoding
LOST = "\0"  # in place of a client that lost a right
CALLERS_MAX = 1024  # whose names are kept
CALLS_MAX = 512  # at the same time, over all connections
CHUNK_SECONDS_MAX = 60.0  # s of real time for a client to take a chunk of a file, up to 4 MB
WRITE_MAX = 10.0  # s of real time for a client to take a message after its call has ended
RESUME_MAX = 600.0  # s of real time for a client that was too slow to read on, until its call is given up
HOST_CALLS_MAX = CALLS_MAX * 3 // 4  # of one host, so that others still reach the robot


class Service:
    """The three calls of the gRPC service."""

    def __init__(self, context: Context, handshakes: Handshakes) -> None:
        self._context, self._handshakes = context, handshakes
        self._callers: dict[str, str] = {}  # names of clients that did not prove another, by peer, as gRPC writes it
        self._of: dict[asyncio.Task[object], str] = {}  # with access: the client whose request a task serves

    def cut_off(self, who: str) -> None:
        """End the requests of a client that lost a right."""
        for task in [task for task, client in self._of.items() if client == who]:
            self._of[task] = LOST
            task.cancel()

    async def sendMsg(self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext) -> pb.RecResponse | None:  # noqa: N802 - the service's name
        """Serve one request with any number of answers, and return the last; the status is OK but for too many."""
        return await self._entered(self._send, request, rpc)

    async def _entered(
        self,
        serve: Callable[[pb.SendRequest | None, grpc.aio.ServicerContext], Awaitable[T]],
        request: pb.SendRequest | None,
        rpc: grpc.aio.ServicerContext,
    ) -> T:
        """Serve a call of the caller, who is the current client meanwhile."""
        self._enter(rpc.peer())
        try:
            return await serve(request, rpc)
        except RecordedEnd as end:
            await rpc.abort(grpc.StatusCode.__members__.get(end.code, grpc.StatusCode.UNKNOWN), "as recorded")
            raise

    async def _send(self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext) -> pb.RecResponse | None:
        robot, peer = self._context.robot, rpc.peer()
        if not robot.admission.enforced:
            return await self._send_admitted(request, rpc, peer)
        await self._admit(rpc, peer)
        if request is not None:
            await self._count(peer, len(request.params))
        task = asyncio.current_task()
        assert task is not None
        self._of[task] = identity()
        try:
            return await self._send_admitted(request, rpc, peer)
        except asyncio.CancelledError:
            if self._of[task] != LOST or request is None:
                raise
            return _answer(request.nameCode, error(InBandError.UNAVAILABLE))
        finally:
            del self._of[task]

    async def _send_admitted(
        self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext, peer: str
    ) -> pb.RecResponse | None:
        robot = self._context.robot
        if request is None:
            _note_unreadable(peer)
            return _answer(0, error(InBandError.BAD_PARAMETERS))
        if (fairness := robot.fairness) is None:
            return await self._serve(request, rpc, peer)
        use = fairness.of(peer.partition(":")[2])
        if fairness.wait(use):
            await wait_for_turn(fairness, use, lambda: stops(request.nameCode, request.params))
        begun = fairness.now()
        try:
            return await self._serve(request, rpc, peer)
        finally:
            fairness.took(use, fairness.now() - begun)

    async def _serve(self, request: pb.SendRequest, rpc: grpc.aio.ServicerContext, peer: str) -> pb.RecResponse | None:
        """Answer a request whose turn it is; return its last answer."""
        code, tap = request.nameCode, self._context.robot.tap

        async def reply(value: object) -> None:
            if tap.watched:
                tap.reply("cyberdog", str(int(code)), write(value), "ok", began=call.began)
            await self._write(rpc, _answer(code, value))

        call = Call(code, request.params, self._context, reply)
        try:
            last = await answer(call)
        except NotJson as bad:
            log.info("%d refused: %s", code, bad)
            return _answer(0, error(InBandError.BAD_PARAMETERS))
        except asyncio.CancelledError:  # the app does not wait for the end
            self._note_end(peer, code, call.began)
            raise
        return None if last is None else _answer(code, last)

    async def getFile(self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext) -> None:  # noqa: N802
        """Serve photos and recordings in chunks; errors are chunks, too."""
        await self._entered(self._fetch, request, rpc)

    async def _fetch(self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext) -> None:
        peer, tap = rpc.peer(), self._context.robot.tap
        if self._context.robot.admission.enforced:
            await self._admit(rpc, peer)
        if request is None:
            _note_unreadable(peer)
            await self._write(rpc, pb.FileChunk(error_code=FileError.ARGUMENTS))
            return
        began = tap.request("cyberdog", str(int(request.nameCode)), request.params) if tap.watched else None
        try:
            fields = read_params(request.params)
        except NotJson:
            fields = {}
        found = get_file(self._context, host_of(peer), request.nameCode, fields, request.params)
        late = None
        async with contextlib.aclosing(found) as chunks:
            async for chunk in chunks:
                if not self._context.robot.admission.may(Right.SEE):  # lost while the file was sent
                    await self._write(rpc, pb.FileChunk(error_code=FileError.CAMERA_SILENT))
                    return
                if tap.watched:
                    tap.reply("cyberdog", str(int(request.nameCode)), chunk.SerializeToString(), "ok", began=began)
                if late := await self._written(rpc, chunk, CHUNK_SECONDS_MAX):
                    break
                await self._count(peer, len(chunk.buffer))
        if late is not None:
            log.info("ended a file transfer: %s reads too slowly", host_of(peer))
            await _give_up(rpc, late, "the file was not read in time")

    def _note_end(self, peer: str, code: int, asked: float | None) -> None:
        inputs = self._context.robot.inputs
        inputs.note_client(CALLED_OFF, "cyberdog", peer, operation=str(int(code)), asked=asked)

    async def _write(self, rpc: grpc.aio.ServicerContext, message: object) -> None:
        """Write to a client, however long that takes."""
        await self._written(rpc, message)

    async def _written(
        self, rpc: grpc.aio.ServicerContext, message: object, patience: float | None = None
    ) -> asyncio.Future[None] | None:
        """Write to a client; the time that this takes is not robot time. Return the write if it outlasts ``patience``.

        A call that ends meanwhile finishes the message: gRPC refuses a last one during another's write.
        """
        with self._context.robot.clock.holding():
            writing: asyncio.Future[None] = asyncio.ensure_future(rpc.write(message))
            try:
                await asyncio.wait([writing], timeout=patience)
            except asyncio.CancelledError:
                _ignore_result(writing)
                await asyncio.wait([writing], timeout=WRITE_MAX)
                raise
        if not writing.done():
            return writing
        await writing
        return None

    async def _count(self, peer: str, size: int) -> None:
        """Count bytes to or from a client; delay one beyond its share."""
        admission = self._context.robot.admission
        if admission.enforced:
            await pay(admission.spend(identity() or host_of(peer), size))

    def _enter(self, peer: str) -> None:
        """Set the caller as the current client; where rights count, ``_admit`` does that."""
        caller = self._callers.get(peer)
        if caller is None:
            self._handshakes.note_request(peer)
            if len(self._callers) >= CALLERS_MAX:
                self._callers.clear()
            caller = self._callers[peer] = f"cyberdog {host_of(peer)}"
        if not self._context.robot.admission.enforced:
            self._context.app.seen(peer)
            set_client(caller, peer)

    async def _admit(self, rpc: grpc.aio.ServicerContext, peer: str) -> None:
        """Set the caller as the current client; only one with the right to see becomes the robot's app."""
        admission = self._context.robot.admission
        names = rpc.auth_context().get("x509_common_name", [])
        proof = Proof(ProofKind.CERTIFICATE, names[0].decode()) if names else NO_PROOF
        address = unquote(peer).partition(":")[2]
        who = admission.cached_identity(address, proof) or admission.cached_identity(address) or ""
        with contextlib.suppress(Unknown):
            who = who or await admission.admit(address, proof)
        set_client(f"cyberdog {who or host_of(peer)}", peer, who)
        if admission.may(Right.SEE):
            self._context.app.seen(peer)
            self._context.owner = who

    async def heartbeat(self, _request: None, rpc: grpc.aio.ServicerContext) -> None:
        """Refuse: only apps serve heartbeats."""
        await rpc.abort(grpc.StatusCode.UNIMPLEMENTED, "the robot sends heartbeats, it takes none")


async def _give_up(rpc: grpc.aio.ServicerContext, late: asyncio.Future[None], why: str) -> None:
    """End a call with an error, once the client has read the ``late`` message, which gRPC lets no status pass."""
    try:
        await asyncio.wait([late], timeout=RESUME_MAX)
    finally:
        _ignore_result(late)
    rpc.set_code(grpc.StatusCode.DEADLINE_EXCEEDED)  # rpc.abort would wait for the client
    rpc.set_details(why)


def _ignore_result(writing: asyncio.Future[None]) -> None:
    """Leave no error behind that nothing awaits: the client may be gone."""
    writing.add_done_callback(lambda written: written.cancelled() or written.exception())


def _note_unreadable(peer: str) -> None:
    log.info("cannot read a request of %s: it is not a SendRequest, or its params are not UTF-8", host_of(peer))


def _answer(code: int, value: object) -> pb.RecResponse:
    """Return a message to the app."""
    text = write(value)
    if len(text) > CHARACTERS_MAX and len(text.encode()) > MESSAGE_MAX - FRAME:
        log.warning("the answer to %d is too long for a message: %d characters", code, len(text))
        text = write(error(InBandError.UNAVAILABLE))
    return pb.RecResponse(nameCode=code, data=text)
