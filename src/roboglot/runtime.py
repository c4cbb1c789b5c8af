"""The only place that joins everything: data folder, clock, fleet, program engine and doors."""

from __future__ import annotations

import asyncio
import fcntl
import logging
import os
from collections.abc import Awaitable, Sequence
from pathlib import Path

from roboglot.config import Config, RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import Clock, LockstepClock, RealClock
from roboglot.model.robot import Robot
from roboglot.programs.engine import Engine
from roboglot.programs.service import ProgramService
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.door import Door
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database

log = logging.getLogger(__name__)
CLOSE_SECONDS = 0.5  # what one part may take to close before it is left behind


class AlreadyRunning(RuntimeError):
    """Another roboglot uses the same data folder."""


class Runtime:
    """One world, its robots, their doors. ``start`` returns when every door answers; ``close`` takes under a second."""

    def __init__(self, config: Config) -> None:
        self.config = config
        self._lock = _lock_folder(config.data)
        self.clock: Clock = LockstepClock() if config.lockstep else RealClock(config.speed)
        self._database = Database(config.data / "roboglot.db")
        self._engine = Engine()
        self.fleet = build_fleet(
            config.world, config.robots, clock=self.clock, seed=config.seed, database=self._database
        )
        self.doors: dict[str, Sequence[Door]] = {
            robot.name: self._build_doors(robot, self.fleet.robots[robot.name]) for robot in config.robots
        }

    def _build_doors(self, config: RobotConfig, robot: Robot) -> Sequence[Door]:
        visual = VisualDoor(ProgramService(robot, self._engine, self._database))
        return (
            SlamwareDoor(robot, config.address, self.config.slamware),
            RoboMasterDoor(robot, config.address, self.config.robomaster),
            CyberDogDoor(robot, config.address, self.config.cyberdog, self.config.data, frames=visual),
            visual,
        )

    async def start(self) -> None:
        """Open every door, then let the world run. Raises OSError naming an address that is taken."""
        for doors in self.doors.values():
            for door in doors:
                await door.start()
        await self.fleet.start(wait=self.config.lockstep)
        self._engine.open_soon()

    async def close(self) -> None:
        """Stop the robots, close the doors, then the world, the engine and the file, whatever of it takes too long."""
        doors = [door for doors in self.doors.values() for door in doors]
        await asyncio.gather(*(_in_time(f"the {door.name} door", door.close()) for door in doors))
        await _in_time("the fleet", self.fleet.close())
        await _in_time("the program engine", self._engine.close())
        self._database.close()
        os.close(self._lock)


async def _in_time(name: str, closing: Awaitable[None]) -> None:
    """Wait for it, but not for long."""
    try:
        await asyncio.wait_for(closing, CLOSE_SECONDS)
    except TimeoutError:
        log.warning("%s did not close in time", name)


def _lock_folder(folder: Path) -> int:
    """Make the data folder and hold it for this process alone; the lock goes with the process."""
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    lock = os.open(folder / "lock", os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise AlreadyRunning(f"another roboglot uses {folder}; stop it, or choose another folder with --data") from None
    return lock
