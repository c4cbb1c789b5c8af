"""Builds robots from the configuration: bodies from simulation or drivers, memory from storage, skills from autonomy.

Knows no door and no socket.
"""

from __future__ import annotations

import asyncio
import dataclasses
import json
import platform
import re
from collections.abc import Awaitable, Mapping, Sequence
from datetime import UTC, datetime
from time import perf_counter, thread_time
from typing import TYPE_CHECKING

from roboglot.autonomy import Autonomy
from roboglot.config import Config, RobotConfig
from roboglot.drivers.driver import Driver
from roboglot.drivers.urls import Drivers
from roboglot.media.streams import add_streams
from roboglot.model.client_context import concerning
from roboglot.model.clock import Clock, LockstepClock, PatientClock, RealClock
from roboglot.model.components.interaction.input_device import InputDevice
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.logistics.traffic_radio import TrafficRadio
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.apps import Apps
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.components.system.settings import Settings
from roboglot.model.geometry import Pose
from roboglot.model.inputs.fairness import Fairness
from roboglot.model.responder import Responder
from roboglot.model.robot import Description, Robot
from roboglot.simulation.bodies.files import body_source
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world, world_sources
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.apps import StoredApps
from roboglot.storage.files import StoredFiles
from roboglot.storage.ledger import StoredLedger
from roboglot.storage.map_memory import StoredMapMemory
from roboglot.storage.maps import StoredMaps
from roboglot.storage.members import StoredMembers
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings
from roboglot.storage.transactions import Transactions
from roboglot.text_files import content_of
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.recording.files import Origin

UNKNOWN = Description(  # description of a real robot until its first report, with the footprint of a medium one
    maker="", model="", serial="", hardware_version="", software_version="", radius=0.25, height=0.3
)
SECRET = re.compile("token|password|secret", re.IGNORECASE)  # names of settings that are omitted from recordings
URL_LOGIN = re.compile("(://)[^/@]*@")  # the credentials in a URL
STEP = 0.1  # s per step while robots brake on a lockstep clock
STEP_PAUSE = 0.001  # real s between two steps, for sockets


@dataclass(frozen=True, slots=True)
class Fleet:
    """One world, and all robots by name: simulated ones in it, real ones behind their drivers."""

    world: World
    robots: dict[str, Robot]
    _autonomies: Sequence[Autonomy]
    _drivers: Sequence[Driver] = ()

    async def start(self, *, wait: bool) -> None:
        """Connect real robots, start the skills, and let the world run.

        ``wait``: the world runs only once every skill is ready (lockstep); otherwise skills become ready meanwhile.
        Real robots that cannot be reached now are connected as soon as they can.
        """
        await asyncio.gather(*(self._connect(driver, wait=wait) for driver in self._drivers))
        for autonomy in self._autonomies:
            with concerning(autonomy.robot.id):
                await autonomy.start(wait=wait)
        await self.world.prepare(wait=wait)
        self.world.start()

    async def _connect(self, driver: Driver, *, wait: bool) -> None:
        with concerning(driver.robot.id):
            await driver.start(wait=wait)

    async def close(self) -> None:
        """Cancel the robots' actions and stop the world."""
        for autonomy in self._autonomies:  # first, or deliveries would continue with the next order
            await autonomy.close()
        clock = next(iter(self.robots.values())).clock
        await _wait_for(clock, *(robot.actions.cancel(reason="shutting down") for robot in self.robots.values()))
        await _wait_for(clock, *(driver.close() for driver in self._drivers))
        self.world.close()


async def _wait_for(clock: Clock, *endings: Awaitable[object]) -> None:
    """Wait for ``endings``, which may take robot time: advance a lockstep clock, which no other task does any more."""
    all_ended = asyncio.gather(*endings)
    while isinstance(clock, LockstepClock) and not all_ended.done():
        await clock.advance(STEP)
        await asyncio.wait((all_ended,), timeout=STEP_PAUSE)
    await all_ended


def clock_of(config: Config) -> Clock:
    """Return the clock of the configuration's robots: on a slow machine it waits, if it has no real robots."""
    if config.lockstep:
        return LockstepClock()
    if any(robot.is_real for robot in config.robots):
        return RealClock(config.speed)
    return PatientClock(config.speed)


def build_fleet(world: str, robots: Sequence[RobotConfig], *, clock: Clock, seed: int, database: Transactions) -> Fleet:
    """Build all robots of the configuration in ``world`` (a name or path). Raises ValueError in plain words."""
    placements = [_placement(robot) for robot in robots if robot.is_simulated]
    simulated = World(load_world(world), placements, clock=clock, seed=seed)
    lockstep = isinstance(clock, LockstepClock)  # time waits for every answer: no client slows down another
    fairness = None if lockstep else Fairness(perf_counter, thread_time)
    built, drivers = dict[str, Robot](), Drivers(own=frozenset(robot.address for robot in robots))
    for config in robots:
        with concerning(config.name):
            if config.is_real:
                robot = built[config.name] = Robot(config.name, UNKNOWN, clock)
                drivers.add(robot, config.body)
            elif config.recording:
                robot = built[config.name] = Robot(config.name, UNKNOWN, clock)
                robot.responder = _responder(config.recording, clock)
            else:
                robot = built[config.name] = Robot(config.name, simulated.description_of(config.name), clock)
                simulated.equip(robot)
                add_streams(robot)
                robot.add(InputDevice, InputDevice())
            if TrafficRadio in robot:
                robot[TrafficRadio].priority = config.priority
            _add_memory(robot, clock, database)
            robot.add(Lease, Lease(robot))
            robot.fairness = fairness
    fleet = Fleet(simulated, built, [Autonomy(robot) for robot in built.values()], drivers.all)
    for robot in built.values():
        if Floors in robot:  # its first map is that of the floor where it is set up
            robot[Floors].begin_on(simulated.truth.floor_of(robot.id))
    return fleet


def _placement(robot: RobotConfig) -> RobotPlacement:
    if robot.start is None:
        return RobotPlacement(robot.name, robot.body, serial=robot.serial)
    start = robot.start
    return RobotPlacement(robot.name, robot.body, Pose(start.x, start.y, start.yaw), start.floor, robot.serial)


def _responder(place: str, clock: Clock) -> Responder:
    """Return a responder with the answers of a recorded robot. Raises ValueError in plain words."""
    from roboglot.recording.playback import open_playback

    return open_playback(place, clock)


def origin_of(config: Config, version: str, *, has_data: bool = False) -> Origin:
    """Return the origin of a recording: settings, seed, versions, and the files that the settings name.

    ``has_data``: there are maps, programs or settings of the robots from earlier runs.
    """
    from roboglot.recording.files import Attachment, Origin

    settings = json.dumps(_public(dataclasses.asdict(config)))
    facts = {
        "version": version,
        "python": platform.python_version(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "world": config.world,
        "seed": str(config.seed),
        "data": "kept" if has_data else "new",
        "clock": "lockstep" if config.lockstep else f"x{config.speed:g}",
        "robots": json.dumps({robot.name: _without_secrets(robot.body) for robot in config.robots}),
    }
    if config.record.redact:
        facts["redact"] = ", ".join(config.record.redact)
    bodies = {robot.body for robot in config.robots if robot.is_simulated}
    sources = [*world_sources(config.world), *(body_source(body) for body in sorted(bodies))]
    files = [Attachment(path.name, "application/octet-stream", content_of(path)) for path in sources]
    return Origin(facts, [Attachment("config.json", "application/json", settings.encode()), *files])


def _public(value: object) -> object:
    """Return ``value`` in JSON's types, without tokens and passwords, including those in URLs."""
    match value:
        case Mapping():
            return {
                str(key): "[redacted]" if inner and SECRET.search(str(key)) else _public(inner)
                for key, inner in value.items()
            }
        case list() | tuple():
            return [_public(inner) for inner in value]
        case bool() | int() | float() | None:
            return value
    return _without_secrets(str(value))


def _without_secrets(url: str) -> str:
    """Return a URL without possible secrets: its log-in and its options."""
    return URL_LOGIN.sub(r"\1", url.partition("?")[0])


def _add_memory(robot: Robot, clock: Clock, database: Transactions) -> None:
    """Add the components with data stored on our disk, for robots of every kind."""
    if Disk in robot:
        database = database.on(robot[Disk])
    places, files = StoredPlaces(database, robot.id, clock, robot.events), StoredFiles(database, robot.id, clock)
    annotations = StoredAnnotations(database, robot.id, clock, robot.events)
    settings = StoredSettings(database, robot.id)
    robot.add(Places, places)
    robot.add(MapAnnotations, annotations)
    robot.add(MapMemory, StoredMapMemory(robot, database, places, annotations, settings, files))
    robot.add(MapLibrary, StoredMaps(database, robot.id))
    robot.add(FileStore, files)
    robot.add(Settings, settings)
    robot.add(Ledger, StoredLedger(database, robot.id))
    robot.add(Members, StoredMembers(database, robot.id, clock, robot.events))
    if Disk in robot:
        robot.add(Apps, StoredApps(database, robot.id, clock, robot[Disk]))
