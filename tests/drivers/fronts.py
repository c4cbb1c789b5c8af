"""One client of each vendor in front of a driven robot: drives, turns, asks, hangs up. Time passes by itself."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Protocol

from roboglot.clients.cyberdog import Certificates, CyberDogClient, values
from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.cyberdog.vocabulary import pose_of
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from roboglot.testing.addresses import free_addresses
from roboglot.wire.cyberdog.chapters.motion.motion import Motion
from roboglot.wire.slamware.chapters.motion import AngleOptions, Direction, MoveByOptions, MoveOptions, MoveToOptions
from roboglot.wire.slamware.geometry import Location
from tests.drivers.clients import TextClient

ADDRESS = free_addresses(1)
SIDE, SPEED = 0.4, 0.3  # m, m/s


class Front(Protocol):
    """A client: a side of a square and a left turn, going ahead until it is gone; what it reports, and where it goes.

    ``battery`` is in percent, ``pose`` in a frame of its own (None: this protocol reports none of such a robot);
    ``navigate`` goes to a point so far to the left by the robot's navigation.
    """

    async def side(self) -> None: ...
    async def turn(self) -> None: ...
    async def battery(self) -> float: ...
    async def pose(self) -> Pose | None: ...
    async def navigate(self, left: float) -> None: ...
    async def go(self) -> None: ...
    async def hang_up(self) -> None: ...


class Text:
    """A RoboMaster script."""

    def __init__(self, client: TextClient) -> None:
        self.client = client

    async def side(self) -> None:
        assert await self.client.ask(f"chassis move x {SIDE} vxy {SPEED} wait_for_complete true;") == "ok"

    async def turn(self) -> None:
        assert await self.client.ask("chassis move z -90 vz 60 wait_for_complete true;") == "ok"

    async def battery(self) -> float:
        return (await self.client.numbers("robot battery ?;"))[0]

    async def pose(self) -> Pose:
        x, y, z = await self.client.numbers("chassis position ?;")
        return Pose(x, -y, -math.radians(z))

    async def navigate(self, left: float) -> None:
        raise NotImplementedError("the protocol has no word for it")

    async def go(self) -> None:
        assert await self.client.ask(f"chassis speed x {SPEED} y 0 z 0;") == "ok"

    async def hang_up(self) -> None:
        self.client.writer.transport.abort()


class Rest:
    """A dashboard."""

    def __init__(self, client: SlamwareClient) -> None:
        self.client = client

    async def side(self) -> None:
        milliseconds = round(SIDE / 0.4 * 1000)
        await (await self.client.begin("MoveByAction", MoveByOptions(Direction.FORWARD, duration=milliseconds)))

    async def turn(self) -> None:
        await (await self.client.begin("RotateAction", AngleOptions(math.pi / 2)))

    async def battery(self) -> float:
        return (await self.client.get_power_status()).battery_percentage

    async def pose(self) -> Pose:
        reported = await self.client.get_odo_pose()
        return Pose(reported.x, reported.y, reported.yaw)

    async def navigate(self, left: float) -> None:
        here = await self.client.get_pose()
        goal = Location(here.x - left * math.sin(here.yaw), here.y + left * math.cos(here.yaw))
        options = MoveToOptions(goal, MoveOptions(mode=0, flags=["precise"], acceptable_precision=0.05))
        await (await self.client.begin("MoveToAction", options))

    async def go(self) -> None:
        await self.client.begin("MoveByAction", MoveByOptions(Direction.FORWARD, duration=1000))

    async def hang_up(self) -> None:
        self.client.close()


class Phone:
    """The CyberDog's app."""

    def __init__(self, client: CyberDogClient, robot: Robot) -> None:
        self.client, self.robot = client, robot
        self.localized = False
        self.going: asyncio.Task[None] | None = None

    async def side(self) -> None:
        await self.client.perform(Motion.TROT_SLOW, seconds=SIDE / SPEED, velocity=(SPEED, 0.0, 0.0))

    async def turn(self) -> None:
        await self.client.perform(Motion.TROT_SLOW, seconds=math.pi / 2, velocity=(0.0, 0.0, 1.0))

    async def battery(self) -> float:
        return (await self.client.found()).battery

    async def pose(self) -> Pose | None:
        """Pushed while the robot is localized."""
        if Localization not in self.robot:
            return None
        if not self.localized:
            await (await self.client.relocalise()).succeeded()
            self.localized = True
        with self.client.watch(values.Pose) as pushes:
            async for reported in pushes:
                return pose_of(reported)
        raise AssertionError

    async def navigate(self, left: float) -> None:
        here = await self.pose()
        assert here
        goal = here.compose(Pose(0.0, left))
        await (await self.client.navigate(goal.x, goal.y)).succeeded()

    async def go(self) -> None:
        async def frames() -> None:
            async with self.client.servo() as joystick:
                joystick.set(SPEED, 0.0, 0.0)
                await asyncio.get_running_loop().create_future()

        self.going = asyncio.ensure_future(frames())

    async def hang_up(self) -> None:
        assert self.going
        await self.client.close()
        self.going.cancel()
        await asyncio.gather(self.going, return_exceptions=True)


class Blocks:
    """Block programs, through frames."""

    def __init__(self, door: VisualDoor, service: ProgramService, robot: Robot) -> None:
        self.door, self.service, self.robot = door, service, robot
        self.ended: set[str] = set()
        self.count = 0
        door.subscribe(self._hear)

    def _hear(self, text: str) -> None:
        reported: dict[str, Any] = json.loads(text).get("feedback") or {}
        if reported.get("operate") == "stop" and reported["id"].startswith("task_"):
            self.ended.add(reported["target_id"])

    async def run(self, body: str) -> None:
        await self.begin(body)
        name = f"t{self.count}"
        async with asyncio.timeout(60):
            while name not in self.ended:  # noqa: ASYNC110 - only polling
                await asyncio.sleep(0.005)

    async def begin(self, body: str) -> None:
        self.count += 1
        common = {"type": "task", "target_id": [f"t{self.count}"]}
        save = {"id": f"s{self.count}", "operate": "save", "mode": "single", "condition": "now", "body": body}
        await self.door.receive(json.dumps(common | save))
        await self.door.receive(json.dumps(common | {"id": f"r{self.count}", "operate": "run"}))

    async def side(self) -> None:
        await self.run(f"cyberdog.motion.go_straight({SPEED}, {SIDE}, 0)\n")

    async def turn(self) -> None:
        await self.run("cyberdog.motion.turn(90, 1)\n")

    async def battery(self) -> float:
        return (await self.printed("cyberdog.bms.data.batt_soc"))[0]

    async def printed(self, what: str, before: str = "") -> list[float]:
        await self.run(f"{before}print({what})\n")
        (printed,) = [entry.text for entry in await self.service.log(f"t{self.count}") if entry.level == "print"]
        return [float(word) for word in printed.split()]

    async def pose(self) -> Pose:
        x, y, z, w = await self.printed(
            "p.position.x, p.position.y, p.orientation.z, p.orientation.w", "p = cyberdog.odometer.data.pose.pose\n"
        )
        return Pose(x, y, 2 * math.atan2(z, w))

    async def navigate(self, left: float) -> None:
        """Pose in a map saved before, as programs need it."""
        await self.robot[MapLibrary].put(StoredMap("office", self.robot[Mapping].grid, 0.0))
        here = self.robot[Localization].pose.compose(Pose(0.0, left))
        (code,) = await self.printed(
            "done.state.code",
            "cyberdog.navigation.turn_on_navigation()\n"
            f"done = cyberdog.navigation.navigation_to_coordinates({here.x}, {here.y}, 0, 0, 0, {here.yaw})\n",
        )
        assert code == 0

    async def go(self) -> None:
        await self.begin(f"cyberdog.motion.go_straight({SPEED}, 0, 60)\n")

    async def hang_up(self) -> None:
        stop = {"type": "task", "id": "x", "operate": "shutdown", "target_id": [f"t{self.count}"]}
        await self.door.receive(json.dumps(stop))


@asynccontextmanager
async def front(kind: str, robot: Robot, folder: Path, port: Callable[[], int]) -> AsyncIterator[Front]:
    """Yield a door of ``kind`` in front of ``robot``, and its client."""
    if kind == "slamware":
        door = SlamwareDoor(robot, ADDRESS, SlamwareConfig(port=0))
        await door.start()
        yield Rest(SlamwareClient(ADDRESS, door.port, clock=robot.clock))
        await door.close()
    elif kind == "robomaster":
        config = RoboMasterConfig(control_port=0, event_port=0, video_port=0, audio_port=0, push_port=9)
        text_door = RoboMasterDoor(robot, ADDRESS, config)
        await text_door.start()
        where = next(int(e.address.rpartition(":")[2]) for e in text_door.endpoints if "text SDK" in e.label)
        client = TextClient(*await asyncio.open_connection(ADDRESS, where), patience=60)
        assert await client.ask("command;") == "ok"
        yield Text(client)
        await text_door.close()
    elif kind == "cyberdog":
        app_port = port()
        dog_door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app_port=app_port), folder)
        export_client(folder / "cyberdog", folder / "phone")
        await dog_door.start()
        proof = Certificates.load(folder / "phone")
        async with CyberDogClient(ADDRESS, proof, port=dog_door.port, app_port=app_port, clock=robot.clock) as phone:
            await phone.found()
            yield Phone(phone, robot)
        await dog_door.close()
    else:
        async with Engine() as engine:
            database = Database(":memory:")
            service = ProgramService(robot, engine, program_stores(database, robot.id))
            visual = VisualDoor(service)
            await visual.start()
            yield Blocks(visual, service, robot)
            await visual.close()
            database.close()
