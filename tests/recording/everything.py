"""Lockstep session with every kind of input: six protocols, a dog's app, hands, the console's desk."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import itertools
import json
import struct
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from roboglot.clients.cyberdog.link import DogLink
from roboglot.clients.errors import ClientError
from roboglot.clients.slamware import SlamwareClient
from roboglot.config import Config, ConsoleConfig, RecordConfig, RobotConfig, load_config
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.inputs.external import CALLED_OFF, GONE, Input
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols import sections
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses, free_port
from roboglot.wire.slamware.chapters.motion import MoveOptions, MoveToOptions
from roboglot.wire.slamware.geometry import Location
from tests.narrowing import of_kind

ADDRESS = free_addresses(1)
TWIST = b"\0\1\0\0" + struct.pack("<6d", 0.2, 0.0, 0.0, 0.0, 0.0, 0.1)  # CDR, little endian
FRAME: dict[str, object] = dict.fromkeys(("style", "describe", "body"), "") | {
    "type": "task",
    "target_id": [],
    "mode": "single",
    "condition": "now",
}
PROGRAM = """
import random
for number in range(3):
    cyberdog.task.block('b%d' % random.randint(0, 99))
    time.sleep(0.4)
"""


def config(folder: Path, **more: object) -> Config:
    base = load_config(
        None,
        {
            "data": str(folder / "data"),
            "world": "office",
            "lockstep": True,
            "cyberdog": {"plaintext": True, "app_port": free_port()},
            **more,
        },
        sections(),
    )
    return dataclasses.replace(
        base,
        robots=(RobotConfig("a", "universal", ADDRESS),),
        record=RecordConfig(to=str(folder / "r.mcap")),
        console=ConsoleConfig(address=ADDRESS),
    )


class Session:
    """One runtime and its clients."""

    def __init__(self, folder: Path, **more: object) -> None:
        self.config = config(folder, **more)
        self.runtime = Runtime(self.config)
        clock = self.runtime.clock
        assert isinstance(clock, LockstepClock)
        self.clock = clock
        self.rest = SlamwareClient(ADDRESS)
        self.pushed: list[tuple[int, str]] = []
        self.answers: dict[int, list[str]] = {}
        self.heard: dict[tuple[str, Direction], int] = {}
        self.photographed = 0  # bytes
        self.gone: list[str] = []  # doors whose clients hung up or cancelled
        self.tasks: set[asyncio.Task[None]] = set()
        self._numbers = itertools.count()
        self.dog: DogLink

    def hear(self, exchange: Exchange) -> None:
        key = exchange.door, exchange.direction
        self.heard[key] = self.heard.get(key, 0) + 1

    def new_app(self) -> DogLink:
        port = int(of_kind(self.config.doors["cyberdog"], CyberDogConfig).app_port)
        return DogLink(
            ADDRESS, 50052, None, RealClock(), app_port=port, pushed=lambda code, text: self.pushed.append((code, text))
        )

    def notice(self, given: Input) -> None:
        if given.kind in (GONE, CALLED_OFF):
            self.gone.append(given.name)

    async def until_heard(self, door: str, direction: Direction, count: int) -> None:
        async with asyncio.timeout(120):  # a busy machine
            while self.heard.get((door, direction), 0) < count:  # noqa: ASYNC110 - the tap calls back in the loop
                await asyncio.sleep(0.0005)

    async def dog_asks(self, code: int, **values: object) -> None:
        """Ask and go on as soon as the dog has heard it; answers may take their time."""

        async def listen() -> None:
            with contextlib.suppress(ClientError):
                async for _, text in self.dog.send(code, json.dumps(values)):
                    self.answers.setdefault(code, []).append(text)

        await self._until_asked(listen())

    async def dog_photographs(self) -> None:
        """Fetch a photo, and go on as soon as the dog has heard it."""

        async def listen() -> None:
            with contextlib.suppress(ClientError):
                async for chunk in self.dog.fetch(4002, '{"command": 1}'):
                    self.photographed += len(chunk.buffer)

        await self._until_asked(listen())

    async def foxglove_drives(self) -> None:
        """Look at all topics but pictures, drive for half a second, and hang up."""
        door, gone = "foxglove", self.gone.count("foxglove")
        socket = await connect(f"ws://{ADDRESS}:8765", subprotocols=[Subprotocol("foxglove.sdk.v1")], max_size=None)
        channels: list[dict[str, Any]] = []
        while not channels:
            message = await socket.recv()
            channels = json.loads(message).get("channels", []) if isinstance(message, str) else []
        wanted = [{"id": c["id"], "channelId": c["id"]} for c in channels if "cam" not in c["topic"]]
        publish = {"id": 7, "topic": "/a/cmd_vel", "encoding": "json", "schemaName": "geometry_msgs/Twist"}
        twist = {"linear": {"x": 0.2, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.2}}
        reading = asyncio.ensure_future(_read_all(socket))  # unread topics would delay the hang-up by 10 s
        messages: list[str | bytes] = [
            json.dumps({"op": "subscribe", "subscriptions": wanted}),
            json.dumps({"op": "advertise", "channels": [publish]}),
            *[struct.pack("<BI", 1, 7) + json.dumps(twist).encode()] * 2,
        ]
        for said in messages:
            number = self.heard.get((door, Direction.REPLY), 0) + 1
            await socket.send(said)
            await self.until_heard(door, Direction.REPLY, number)
            await self.clock.advance(0.123)
        await socket.close()
        await reading
        async with asyncio.timeout(120):  # a busy machine
            while self.gone.count(door) == gone:  # noqa: ASYNC110 - the robot calls back in the loop
                await asyncio.sleep(0.0005)

    async def ros2_drives(self) -> None:
        """Hand one message of ROS 2 to its door, as Zenoh does."""
        number = self.heard.get(("ros2", Direction.REPLY), 0) + 1
        door: Any = self.runtime.doors["a"].door("ros2")
        door.receive("cmd_vel", TWIST)
        await self.until_heard("ros2", Direction.REPLY, number)

    async def _until_asked(self, listening: Coroutine[object, object, None]) -> None:
        number = self.heard.get(("cyberdog", Direction.REQUEST), 0) + 1
        task = asyncio.ensure_future(listening)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)
        await self.until_heard("cyberdog", Direction.REQUEST, number)

    async def console_does(self, path: str, **values: object) -> None:
        console = self.runtime.console
        assert console is not None
        await asyncio.to_thread(_post, f"http://{ADDRESS}:{console.port}/api/{path}", values)

    async def frame(self, socket: ClientConnection, operate: str, body: str = "") -> None:
        number = self.heard.get(("visual", Direction.REQUEST), 0) + 1
        targets = [] if operate == "inquiry" else ["t"]
        frame = FRAME | {"target_id": targets, "id": f"x-{next(self._numbers)}", "operate": operate, "body": body}
        await socket.send(json.dumps(frame))
        await self.until_heard("visual", Direction.REQUEST, number)


def _post(url: str, values: object) -> None:
    request = Request(url, json.dumps(values).encode(), {"content-type": "application/json"})
    with urlopen(request, timeout=60) as answer:
        assert answer.status == 200


@asynccontextmanager
async def begun(folder: Path, **more: object) -> AsyncIterator[Session]:
    session = Session(folder, **more)
    await session.runtime.start()
    session.runtime.fleet.robots["a"].tap.listen(session.hear)
    session.runtime.fleet.robots["a"].inputs.listen(session.notice)
    try:
        yield session
    finally:
        session.rest.close()
        for task in tuple(session.tasks):
            task.cancel()
        await session.runtime.close()


async def hold(folder: Path, rounds: int) -> Session:
    """Hold a session of ``rounds`` times 20 s of robot time, with clients of Foxglove and ROS 2, too."""
    async with begun(folder, foxglove={"enabled": True}, ros2={"enabled": True}) as session:
        clock, rest = session.clock, session.rest
        reader, writer = await asyncio.open_connection(ADDRESS, 40923)

        async def text(line: bytes) -> None:
            writer.write(line)
            await reader.readuntil(b";")

        async with connect(f"ws://{ADDRESS}:50053/programs") as socket, asyncio.TaskGroup() as group:
            reading = group.create_task(_read_all(socket))
            await clock.advance(1.037)
            await session.frame(socket, "save", PROGRAM)
            await clock.advance(0.1)
            for number in range(rounds):
                session.dog = session.new_app()
                await session.dog.open()
                await session.dog_asks(10001)
                await clock.advance(1.513)
                await session.dog_asks(1004, motion_id=111 if number % 2 else 101)
                await clock.advance(0.831)
                await session.frame(socket, "run")
                await session.dog_asks(6003, map_name="")
                await rest.begin("MoveToAction", MoveToOptions(Location(0.5 + 0.3 * (number % 3), 0.2), MoveOptions()))
                await clock.advance(2.513)
                box = {"x": 2.0, "y": 1.0 + 0.1 * number, "width": 0.3, "depth": 0.3}
                await session.console_does("world/add_box", **box)
                await session.dog_asks(6004, type=1, map_name="", goalX=1.0, goalY=0.4, theta=0.0)
                await clock.advance(2.021)
                for line in (
                    b"command;",
                    b"chassis position ?;",
                    b"blaster bead 2;",
                    b"blaster fire;",
                    b"gimbal move y 9;",
                ):
                    await text(line)
                await session.console_does("world/inject_fault", kind="lidar_gone", robot="a", duration=1.5)
                await rest.get_pose()
                await session.dog_photographs()
                await clock.advance(2.411)
                await session.dog_asks(2002, **FRAME | {"operate": "inquiry", "id": f"d-{number}"})
                await session.frame(socket, "inquiry")
                await session.console_does("robots/a/drive", x=0.2, seconds=1.0)
                await clock.advance(1.117)
                await session.console_does("world/push", robot="a", x=4.0, y=1.0)
                session.runtime.fleet.world.stage.touch("a")
                await clock.advance(2.5)
                await session.dog_asks(6009, type=0)
                await clock.advance(1.011)
                await session.foxglove_drives()
                await session.ros2_drives()
                await session.console_does("world/remove_box", number=_last_box(session))
                await session.dog.close()  # the app leaves without notice
                await clock.advance(6.557)
            reading.cancel()
        writer.close()
    return session


def _last_box(session: Session) -> int:
    return session.runtime.fleet.world.stage.obstacles[-1].number


async def _read_all(socket: ClientConnection) -> None:
    async for _ in socket:
        pass
