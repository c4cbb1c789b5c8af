"""Robots with programs and someone who sends frames to them."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from tests.protocols.visual.front_end import FrontEnd


@pytest.fixture
async def engine() -> AsyncIterator[Engine]:
    async with Engine() as engine:
        yield engine


@pytest.fixture
async def plain_robot(clock: LockstepClock) -> Robot:
    """A robot with a clock and nothing else."""
    return Robot(
        "a",
        Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.2, height=0.3),
        clock,
    )


@pytest.fixture
async def connect(engine: Engine, clock: LockstepClock) -> AsyncIterator[Callable[..., Any]]:
    """Give a robot programs and a front end; the database is in memory unless another is given."""
    closing: list[Any] = []

    async def connect(robot: Robot, database: Database | None = None) -> FrontEnd:
        if database is None:
            database = Database(":memory:")
            closing.append(database.close)
        service = ProgramService(robot, engine, program_stores(database, robot.id))
        door = VisualDoor(service)
        await door.start()
        closing.append(door.close)
        return FrontEnd(door, service, clock)

    yield connect
    for close in reversed(closing):
        if (pending := close()) is not None:
            await pending


@pytest.fixture
async def app(connect: Callable[..., Any], plain_robot: Robot) -> FrontEnd:
    """A front end of the robot without parts."""
    front_end: FrontEnd = await connect(plain_robot)
    return front_end
