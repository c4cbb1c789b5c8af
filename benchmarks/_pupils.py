"""Clients in a separate process, one for each robot, with ten requests a second; and what they measure.

REST clients ask for the pose and have their robot turn, text clients turn theirs and take pushes at 10 Hz, gRPC
clients send frames that let the dog turn, and take its heartbeats. Some text clients film: they take the video's bytes.
What they send is ready (for gRPC in ``_grpc_bytes.py``), as they share two cores with the robots, which are measured.
"""

from __future__ import annotations

import asyncio
import json
import socket
import ssl
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from ipaddress import IPv4Address
from multiprocessing import get_context
from typing import NamedTuple

from _grpc_bytes import call, secured, serve

from roboglot.clients.cyberdog import Certificates
from roboglot.wire.cyberdog.channel import HEARTBEAT_PERIOD
from roboglot.wire.cyberdog.chapters.motion.motion import Motion
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

REST, TEXT, GRPC = "hermes", "robomaster_ep", "cyberdog2"  # the bodies that each kind of client supports
LOOK = 0.01  # s between two checks of how late the clients' own loop is
RATE = 10  # Hz, of requests and of pushes
CLIENTS = 1 << 10  # offset of their addresses above the robots'
PICTURE = b"\x00\x00\x00\x01\x09"  # a delimiter precedes each
POSE = b"GET /api/core/slam/v1/localization/pose HTTP/1.1\r\nHost: localhost\r\n\r\n"
MOVE = b'{"action_name":"slamtec.agent.actions.MoveByAction","options":{"direction":3,"duration":1500}}'
TURN = b"POST /api/core/motion/v1/actions HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n%s" % (
    len(MOVE),
    MOVE,
)


def request_of(code: Code, fields: dict[str, object]) -> bytes:
    """Return a request to a dog."""
    return pb.SendRequest(nameCode=code, params=json.dumps(fields)).SerializeToString()


FRAME: dict[str, object] = {
    "motion_id": int(Motion.TROT_SLOW),
    "cmd_type": 1,
    "cmd_source": 0,
    "vel_des": [0.0, 0.0, 0.3],
}
SERVO = request_of(Code.SERVO, FRAME | {"step_height": [0.05, 0.05]})
STAND_UP = request_of(Code.MOTION, {"motion_id": int(Motion.STAND_UP), "cmd_source": 0, "duration": 0})
PUSH = pb.SendRequest(nameCode=1).SerializeToString()[:1]  # a heartbeat begins otherwise
NOTHING = pb.RecResponse(data="{}").SerializeToString()
FINE = pb.Result(result="ok").SerializeToString()


class Lesson(NamedTuple):
    """Task of the clients: body and address of each robot, which are filmed, and the ``seconds`` that count."""

    robots: list[tuple[str, str]]
    filmed: set[str]
    proof: Certificates
    app: str
    settle: float
    seconds: float


@dataclass(slots=True)
class Seen:
    """Observations of all clients of one kind: s of each answer, and pushes a second of each robot."""

    waits: list[float] = field(default_factory=list)
    pushes: list[float] = field(default_factory=list)
    pictures: list[float] = field(default_factory=list)
    refused: int = 0

    def percentile(self, share: float) -> float:
        """ms that so many of the requests waited at most."""
        return percentile(self.waits, share)


def percentile(values: list[float], share: float) -> float:
    """Return the ms that so many of these s are at most."""
    return 1e3 * sorted(values)[min(len(values) - 1, int(share * len(values)))]


@dataclass(slots=True)
class Burden:
    """The clients' own process: delays of its loop that it caused itself (s), and its cores."""

    late: list[float] = field(default_factory=list)
    cores: float = 0.0


class App:
    """The phone that all dogs call."""

    def __init__(self) -> None:
        self.beats: dict[str, int] = {}

    def answer(self, request: bytes) -> bytes:
        """Count a heartbeat, or acknowledge a push."""
        if request.startswith(PUSH):
            return request[: len(PUSH) + 4] + NOTHING
        serial = pb.Ticks.FromString(request).sn
        self.beats[serial] = self.beats.get(serial, 0) + 1
        return FINE


@dataclass(slots=True)
class Class:
    """The clients of one run."""

    lesson: Lesson
    seen: dict[str, Seen] = field(default_factory=lambda: {kind: Seen() for kind in (REST, TEXT, GRPC)})
    own: Burden = field(default_factory=Burden)
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    began: float = 0.0
    proof: ssl.SSLContext = field(init=False)

    async def run(self) -> tuple[dict[str, Seen], Burden]:
        """Have every client do its part."""
        app, lesson = App(), self.lesson
        server = await serve(lesson.app, secured(lesson.proof, ssl.PROTOCOL_TLS_SERVER), app.answer)
        self.proof = secured(lesson.proof, ssl.PROTOCOL_TLS_CLIENT)
        parts: dict[str, Callable[[int, str], Awaitable[None]]] = {REST: self.rest, TEXT: self.text, GRPC: self.dog}
        tasks = [asyncio.ensure_future(parts[body](n, at)) for n, (body, at) in enumerate(lesson.robots)]
        await asyncio.sleep(lesson.settle)
        self.began = time.perf_counter()
        self.ready.set()
        before, used = dict(app.beats), time.process_time()
        while (due := time.perf_counter() + LOOK) < self.began + lesson.seconds:
            await asyncio.sleep(LOOK)
            self.own.late.append(time.perf_counter() - due)
        self.own.cores = (time.process_time() - used) / lesson.seconds
        for serial, count in app.beats.items():
            self.seen[GRPC].pushes.append((count - before.get(serial, 0)) * HEARTBEAT_PERIOD / lesson.seconds)
        await asyncio.gather(*tasks)
        server.close()
        return self.seen, self.own

    async def beats(self, number: int, kind: str, request: Callable[[int], Awaitable[bool]]) -> None:
        """Send a request at every beat, each client a little after the one before it; count once all have begun."""
        await self.ready.wait()
        began, seen = self.began + number / len(self.lesson.robots) / RATE, self.seen[kind]
        for beat in range(round(self.lesson.seconds * RATE)):
            await asyncio.sleep(began + beat / RATE - time.perf_counter())
            sent = time.perf_counter()
            seen.refused += not await request(beat)
            seen.waits.append(time.perf_counter() - sent)

    async def rest(self, number: int, address: str) -> None:
        """Ask where the robot is; once a second have it turn on."""
        await self.ready.wait()  # idle connections are closed
        reader, writer = await asyncio.open_connection(address, 1448)

        async def request(beat: int) -> bool:
            writer.write(POSE if beat % RATE else TURN)
            head = await reader.readuntil(b"\r\n\r\n")
            await reader.readexactly(int(head.lower().partition(b"content-length:")[2].partition(b"\r\n")[0]))
            return head.startswith(b"HTTP/1.1 200")

        await self.beats(number, REST, request)
        writer.close()

    async def text(self, number: int, address: str) -> None:
        """Drive, and take pushes; film, if that is this client's part."""
        host, loop = str(IPv4Address(address) + CLIENTS), asyncio.get_running_loop()
        reader, writer = await asyncio.open_connection(address, 40923, local_addr=(host, 0))
        inbox, pushes = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), 0
        inbox.bind((host, 40924))
        inbox.setblocking(False)

        def pushed() -> None:
            nonlocal pushes
            pushes += inbox.recv(2048).startswith(b"chassis push position")

        loop.add_reader(inbox, pushed)
        writer.write(b"command;chassis push position on pfreq %d;" % RATE)
        await reader.readuntil(b";ok;")
        film = asyncio.ensure_future(self.film(address)) if address in self.lesson.filmed else None
        if film:
            writer.write(b"stream on;")
            await reader.readuntil(b"ok;")

        async def request(_: int) -> bool:
            writer.write(b"chassis speed x 0 y 0 z 30;")
            return await reader.readuntil(b";") == b"ok;"

        await self.ready.wait()
        before = pushes
        await self.beats(number, TEXT, request)
        await asyncio.sleep(self.began + self.lesson.seconds - time.perf_counter())
        self.seen[TEXT].pushes.append((pushes - before) / (time.perf_counter() - self.began))
        if film:
            await film
        loop.remove_reader(inbox)
        inbox.close()
        writer.close()

    async def film(self, address: str) -> None:
        """Count the pictures that come."""
        reader, writer = await asyncio.open_connection(address, 40921)
        pictures, end = 0, 0.0
        while not end or time.perf_counter() < end:
            data = await reader.read(1 << 18)
            if self.ready.is_set():
                end = self.began + self.lesson.seconds
                pictures += data.count(PICTURE)
        self.seen[TEXT].pictures.append(pictures / self.lesson.seconds)
        writer.close()

    async def dog(self, number: int, address: str) -> None:
        """Have the dog stand up, then turn, frame by frame."""
        line = await call(address, self.proof)

        async def tell(request: bytes) -> bool:
            answer = await line.ask(request)
            return bool(answer) and b'"error_code"' not in answer

        await tell(STAND_UP)
        await self.beats(number, GRPC, lambda _: tell(SERVO))
        line.transport.close()


def attend(lesson: Lesson) -> tuple[dict[str, Seen], Burden]:
    """Run the clients of a lesson in this process."""
    import uvloop

    return uvloop.run(Class(lesson).run())


def in_a_process(lesson: Lesson) -> tuple[dict[str, Seen], Burden]:
    """Run the clients of a lesson in a separate process."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(attend, (lesson,))
