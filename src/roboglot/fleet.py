"""Builds robots from the configuration: body from the simulation, memory from storage, skills from autonomy.

Knows no door and no socket.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass

from roboglot.autonomy import Autonomy
from roboglot.config import RobotConfig
from roboglot.media.streams import add_streams
from roboglot.model.clock import Clock, LockstepClock
from roboglot.model.components.annotations import MapAnnotations
from roboglot.model.components.apps import Apps
from roboglot.model.components.disk import Disk
from roboglot.model.components.file_store import FileStore
from roboglot.model.components.input_device import InputDevice
from roboglot.model.components.ledger import Ledger
from roboglot.model.components.map_library import MapLibrary
from roboglot.model.components.members import Members
from roboglot.model.components.places import Places
from roboglot.model.components.settings import Settings
from roboglot.model.robot import Robot
from roboglot.simulation.ros_map import load_world
from roboglot.simulation.world import RobotPlacement, World
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.apps import StoredApps
from roboglot.storage.database import Database
from roboglot.storage.files import StoredFiles
from roboglot.storage.ledger import StoredLedger
from roboglot.storage.maps import StoredMaps
from roboglot.storage.members import StoredMembers
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings

BRAKING = 0.1  # s that pass at a time while robots come to a stand on a lockstep clock


@dataclass(frozen=True, slots=True)
class Fleet:
    """One world and the robots in it, by name."""

    world: World
    robots: dict[str, Robot]
    _autonomies: Sequence[Autonomy]

    async def start(self, *, wait: bool) -> None:
        """Let the world run. ``wait``: only when every skill is ready (lockstep); otherwise they follow soon after."""
        for autonomy in self._autonomies:
            await autonomy.start(wait=wait)
        await self.world.prepare(wait=wait)
        self.world.start()

    async def close(self) -> None:
        """Cancel what the robots do and stop the world."""
        stopping = asyncio.gather(*(robot.actions.cancel(reason="shutting down") for robot in self.robots.values()))
        clock = next(iter(self.robots.values())).clock
        while isinstance(clock, LockstepClock) and not stopping.done():
            await clock.advance(BRAKING)  # nobody else lets time pass any more, and braking takes some
        await stopping
        for autonomy in self._autonomies:
            await autonomy.close()
        self.world.close()


def build_fleet(world: str, robots: Sequence[RobotConfig], *, clock: Clock, seed: int, database: Database) -> Fleet:
    """All robots of the configuration in the named (or given by path) world. Raises ValueError in plain words."""
    placements = [RobotPlacement(robot.name, robot.body) for robot in robots]
    simulated = World(load_world(world), placements, clock=clock, seed=seed)
    built = {robot.name: _build_robot(robot, simulated, clock, database) for robot in robots}
    return Fleet(simulated, built, [Autonomy(robot) for robot in built.values()])


def _build_robot(config: RobotConfig, world: World, clock: Clock, database: Database) -> Robot:
    robot = Robot(config.name, world.description_of(config.name), clock)
    world.equip(robot)
    add_streams(robot)
    robot.add(InputDevice, InputDevice())
    database = database.on(robot[Disk])
    robot.add(Places, StoredPlaces(database, robot.id, clock, robot.events))
    robot.add(MapAnnotations, StoredAnnotations(database, robot.id, clock, robot.events))
    robot.add(MapLibrary, StoredMaps(database, robot.id))
    robot.add(FileStore, StoredFiles(database, robot.id, clock))
    robot.add(Settings, StoredSettings(database, robot.id))
    robot.add(Ledger, StoredLedger(database, robot.id, in_place=isinstance(clock, LockstepClock)))
    robot.add(Members, StoredMembers(database, robot.id, clock, robot.events))
    robot.add(Apps, StoredApps(database, robot.id, clock, robot[Disk]))
    return robot
