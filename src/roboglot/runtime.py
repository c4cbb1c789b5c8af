"""Composition of the program: data folder, clock, fleet, program engine and doors."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import gc
import logging
import os
import ssl
from collections.abc import Sequence
from datetime import UTC, datetime, tzinfo
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from roboglot.clients.errors import ClientError
from roboglot.clients.visual.cloud import CloudLink
from roboglot.config import Config, RobotConfig, refuse_unguarded
from roboglot.console.desk import CLIENT, Desk
from roboglot.console.desk import World as ConsoleWorld
from roboglot.console.recordings.running import Recordings
from roboglot.console.server import Console
from roboglot.console.studio.programs import FOLDER, ClassHome, Programs, Studio
from roboglot.control.lease_server import LeaseServer
from roboglot.control.record_server import RecordServer
from roboglot.extras import own_version
from roboglot.fleet import build_fleet, clock_of, origin_of
from roboglot.hosting.closing import close_in_time
from roboglot.hosting.folder_lock import lock_folder
from roboglot.model.components.system.lease import Lease
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Limits
from roboglot.programs.rehearsing import Scene
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols import DOORS, open_doors
from roboglot.protocols.browsers import own_names
from roboglot.protocols.door import Clouds, DoorType, Endpoint, PortKind, Site
from roboglot.protocols.robot_doors import RobotDoors
from roboglot.rehearsal import Rehearsals, scene_of
from roboglot.storage.opening import open_database, open_registry
from roboglot.storage.outbox import Outbox
from roboglot.storage.programs import program_stores
from roboglot.storage.registry_lease import RegistryLease, holder_of
from roboglot.storage.robot_registry import RobotRegistry
from roboglot.storage.transactions import Transactions
from roboglot.transport.own_addresses import own_addresses
from roboglot.transport.tls import Tls, server_context
from roboglot.validation import host_and_port

if TYPE_CHECKING:
    from roboglot.access.guard import Guard
    from roboglot.access.tunnel.gateway import Gateway
    from roboglot.recording.recorder import Recorder

log = logging.getLogger(__name__)
RING_FOLDER = "recordings"  # in the data folder: the minutes before a fault
EVERYWHERE = frozenset({"0.0.0.0", "::"})  # a program that listens there has each of this machine's addresses


class Runtime:
    """One world, its robots, their doors. ``start`` returns when every door answers; ``close`` takes under a second."""

    def __init__(
        self, config: Config, doors: tuple[DoorType, ...] = DOORS, *, class_home: ClassHome | None = None
    ) -> None:
        """``class_home``: a classroom that this world shares with others; None: a classroom of its own."""
        refuse_unguarded(config)
        self.config, self._class_home = config, class_home
        self._files = contextlib.ExitStack()  # the lock, databases and the list of people
        try:
            self._build(doors)
        except BaseException:
            self._files.close()
            raise

    def _build(self, doors: tuple[DoorType, ...]) -> None:
        """Build everything; what is opened here is closed by ``_files``."""
        config = self.config
        self._files.callback(os.close, lock_folder(config.data))
        self.clock = clock_of(config)
        file, names = config.data / "roboglot.db", [robot.name for robot in config.robots]
        self._has_data = file.exists() or bool(config.database)
        self._database = open_database(file, config.database, names, in_place=config.lockstep)
        self._files.callback(self._database.close)
        limits = dataclasses.asdict(config.programs)
        self._memory_together = limits.pop("memory_together")
        self._engine: Engine | None = None
        self._limits = Limits(**limits)
        self.fleet = build_fleet(
            config.world, config.robots, clock=self.clock, seed=config.seed, database=self._database
        )
        self._registry: Transactions | None = None
        self._registry_lease = self._join_registry()
        self._access_database: Transactions | None = None  # on a server: the list of people and the audit
        self.guard = self._build_guard() if config.access.on else None
        if self.guard is not None:
            self._files.callback(self.guard.close)
        for robot in self.fleet.robots.values():
            robot.admission.outsiders = config.insecure
        self._gateway: Gateway | None = None
        self._tls = self._build_tls()
        self.leases = LeaseServer(
            config.data, self.fleet.robots, self.fleet.world.stage, (*(door.name for door in doors), CLIENT)
        )
        self._recorder: Recorder | None = None
        self._record_server = RecordServer(config.data, lambda: self.recorder)
        self._door_types = doors
        self._programs: dict[str, Programs] = {}
        self._rehearsals = Rehearsals(memory_together=self._memory_together)
        self.doors = {robot.name: self._build_doors(robot, self.fleet.robots[robot.name]) for robot in config.robots}
        self.console = Console(self.build_desk(), config.console, self._tls) if config.console.enabled else None

    def _join_registry(self) -> RegistryLease | None:
        """Make every robot's lease depend on the registry. Raises OSError, ValueError if it cannot be opened."""
        where = self.config.registry or self.config.database
        if not where:
            return None
        self._registry = open_registry(where)
        self._files.callback(self._registry.close)
        leases = {name: robot[Lease] for name, robot in self.fleet.robots.items()}
        addresses = {robot.name: robot.address for robot in self.config.robots}
        registry_lease = RegistryLease(
            RobotRegistry(self._registry),
            addresses,
            holder_of(self.config.data),
            lambda robot: leases[robot].halt("this program may not move the robot any more"),
        )
        for name, lease in leases.items():
            lease.fence(partial(registry_lease.refusal, name))
        return registry_lease

    def _build_guard(self) -> Guard:
        """Return the guard of all doors. Its list is a file, or in the robots' database. Raises OSError, ValueError."""
        from roboglot.access.guard import Guard
        from roboglot.access.store import FILE

        database = self.config.database
        if database and self._registry is not None and self.config.registry in ("", database):
            self._access_database = self._registry
        elif database:
            self._access_database = open_registry(database)
            self._files.callback(self._access_database.close)
        if database and (unused := self.config.data / FILE).exists():
            log.warning("the list of people in %s is not used, but the database's: see `roboglot access copy`", unused)
        return Guard(self.config.data, self.config.access, self.fleet.robots, shared=self._access_database)

    @property
    def recorder(self) -> Recorder:
        """Recorder of these robots; it and its libraries are loaded at the first use."""
        if self._recorder is None:
            from roboglot.recording.recorder import Recorder

            stage = self.fleet.world.stage
            origin = origin_of(self.config, own_version(), has_data=self._has_data)
            inputs = self.fleet.world.inputs
            self._recorder = Recorder(self.config.record, self.fleet.robots, stage, self.clock, origin, inputs)
        return self._recorder

    def _begin_recording(self) -> None:
        """Begin the recording of the configuration, from the first second on. Raises NotRecording."""
        wanted = self.config.record
        if wanted.to:
            self.recorder.start(wanted.to)
        if wanted.ring:
            self.recorder.keep_ring(self.config.data / RING_FOLDER)

    def _build_doors(self, config: RobotConfig, robot: Robot) -> RobotDoors:
        stores = program_stores(self._database, robot.id)
        services: list[ProgramService] = []

        def programs(zone: tzinfo, filter_required: bool) -> ProgramService:
            engine = self._shared_engine(filter_required)
            service = ProgramService(robot, engine, stores, limits=self._limits, zone=zone)
            services.append(service)
            return service

        def cloud(address: str, token: str) -> CloudLink:
            return CloudLink(address, token, robot.id)

        clouds = Clouds(link=cloud, failures=ClientError, outbox=Outbox(self._database, robot.id))
        access = self.config.access
        people = Path(access.people) if access.on and access.people else None
        site = Site(robot, config.address, self.config.data, programs, clouds, self._tls, people=people)
        doors = open_doors(site, self.config, self._door_types)
        if services and site.frames is not None:
            self._programs[robot.id] = Programs(robot, site.frames, services[-1])
        return RobotDoors(robot, doors)

    def _shared_engine(self, filter_required: bool) -> Engine:
        """Return the engine that all robots share; the first door that runs programs decides on its filter."""
        if self._engine is None:
            self._engine = Engine(filter_required=filter_required, memory_together=self._memory_together)
        return self._engine

    def _build_gateway(self, guard: Guard) -> Gateway:
        """Return the one port of all robots for `roboglot connect`, with the certificate of the CyberDog doors."""
        from roboglot.access.tunnel.gateway import Gateway, Ports
        from roboglot.protocols.cyberdog.certificates import ensure_certificates
        from roboglot.protocols.cyberdog.pem_files import FOLDER, SERVER_CERT, SERVER_KEY

        config, (host, port) = self.config, host_and_port(self.config.access.gateway, "access.gateway")

        def ports(kind: PortKind) -> tuple[int, ...]:
            return tuple(number for door in self._door_types for number in door.port_numbers(config, kind).values())

        tcp, pushes, broadcasts, apps = map(ports, (PortKind.TCP, PortKind.PUSH, PortKind.BROADCAST, PortKind.APP))
        robots = {
            robot.name: (self.fleet.robots[robot.name], Ports(robot.address, tcp, pushes, broadcasts, apps))
            for robot in config.robots
        }
        ensure_certificates(config.data / FOLDER)
        tls = config.data / FOLDER / "tls"
        return Gateway(guard, robots, host, port, (tls / SERVER_CERT, tls / SERVER_KEY))

    def _build_tls(self) -> Tls | None:
        """Return TLS for REST, programs and pages; None: no encryption. Raises OSError, ValueError."""
        settings = self.config.access.tls
        if not (self.config.access.on and settings.on):
            return None
        from roboglot.protocols.cyberdog.certificates import ensure_site
        from roboglot.protocols.cyberdog.pem_files import FOLDER

        pair = Path(settings.certificate), Path(settings.key)
        if not settings.certificate:
            pair = ensure_site(self.config.data / FOLDER, _names(self.config))
        try:
            context = server_context(*pair)
        except ssl.SSLError as error:
            raise ValueError(f"[access.tls] {pair[0]}: {error}") from None
        if settings.certificate:
            from roboglot.protocols.cyberdog.signing import valid_until

            if (until := valid_until(pair[0])) < datetime.now(UTC):
                log.warning("[access.tls] %s expired on %s: clients refuse it", pair[0], until.date())
        return Tls(context, settings.plain)

    def build_desk(self) -> Desk:
        """Return the desk of a console."""

        def endpoints() -> dict[str, Sequence[Endpoint]]:
            return {name: doors.endpoints for name, doors in self.doors.items()}

        bodies = {robot.name: robot.body for robot in self.config.robots}
        world = ConsoleWorld(self.config.world, own_version(), self.clock, self.config.seed, bodies)
        data, home = self.config.data, self._class_home
        folders = (FOLDER, data / "lessons")
        studio = Studio(self._programs, self._rehearsals, self._scene_of, folders, data / "classes", home)

        def running_programs() -> int:
            return 0 if self._engine is None else self._engine.running

        desk = Desk(world, self.fleet.robots, self.fleet.world.stage, endpoints, studio, running_programs)
        desk.recordings = Recordings(self.config.data, lambda: self.recorder)
        desk.sessions = data / "sessions.db" if self.guard is not None else None
        return desk

    def _scene_of(self, name: str) -> Scene:
        """Return the current scene for a rehearsal of a robot's program. Raises ValueError for a real robot."""
        robots = {robot.name: robot for robot in self.config.robots}
        if robots[name].is_real:
            raise ValueError(f"robot {name} is not simulated: there is no copy of its world to try things in")
        others = [robot.name for robot in robots.values() if robot.name != name and not robot.is_real]
        return scene_of(self.fleet.world.stage, name, self.config.world, robots[name].body, others)

    async def start(self) -> None:
        """Open every door, then let the world run. Raises OSError with the address if it is taken."""
        if self._registry_lease is not None:
            await self._registry_lease.acquire()
            self._registry_lease.start_renewing()
        if self.guard is not None:
            self.guard.start()
        self._begin_recording()
        try:
            for doors in self.doors.values():
                await doors.open()
        except OSError:  # another try may record to the same file
            if self._recorder is not None:
                await self._recorder.discard()
            raise
        await self.leases.open()
        await self._record_server.open()
        if self.guard is not None and self.config.access.gateway:
            self._gateway = self._build_gateway(self.guard)
            await self._gateway.start()
            if self._registry_lease is not None:
                await self._registry_lease.announce(self._gateway.reached_at(), self._gateway.certificate())
        if self.console is not None:
            self.console.open()
        await self.fleet.start(wait=self.config.lockstep)
        if self._engine is not None:
            self._engine.open_later()
        gc.freeze()  # everything loaded stays: the collector need not scan it again

    async def close(self) -> None:
        """Stop the robots, close doors, world, engine and file; parts that take too long are abandoned."""
        for database in filter(None, (self._database, self._registry, self._access_database)):
            database.end_soon()
        if self.console is not None:
            await close_in_time("the console", self.console.close())
        await asyncio.gather(*(doors.close() for doors in self.doors.values()))
        await close_in_time("control of the robots", self.leases.close())
        await self._record_server.close()
        if self.clock.repeats:  # from here on robot time needed to stop depends on the machine
            await self._close_recorder()
        await close_in_time("the fleet", self.fleet.close())
        await self._close_recorder()
        await close_in_time("the rehearsals", self._rehearsals.close())
        if self._engine is not None:
            await close_in_time("the program engine", self._engine.close())
        if self._gateway is not None:
            await close_in_time("the gateway", self._gateway.close())
        if self._registry_lease is not None:
            await self._registry_lease.close()
        self._files.close()

    async def _close_recorder(self) -> None:
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            await recorder.close()


def _names(config: Config) -> set[str]:
    """Return all addresses and host names by which clients reach the robots and the console."""
    hosts = {host for part in (config.console, *config.doors.values()) for host in getattr(part, "hosts", ())}
    names = {robot.address for robot in config.robots} | {config.console.address} | own_names()
    names |= {host for host in hosts if host.isascii()}  # others are no names of certificates
    return names | set(own_addresses()) if EVERYWHERE & names else names
