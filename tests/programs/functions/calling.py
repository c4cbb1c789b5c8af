"""Calls functions as a running program does, without a process."""

from __future__ import annotations

import asyncio
from typing import Any

from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.programs.functions import ability_set
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import call


class Caller:
    """``await caller("cyberdog.motion.turn", 90)`` lets robot time pass until the call returns."""

    def __init__(self, robot: Robot, clock: LockstepClock, task: str = "t") -> None:
        ability_set()  # loads the functions
        self.session = Session(robot, task, self)
        self.robot = robot
        self.clock = clock
        self.blocks: list[str] = []
        self.breakpoints = 0
        self.written: list[str] = []

    def begin_block(self, id: str) -> None:
        self.blocks.append(id)

    async def breakpoint(self) -> None:
        self.breakpoints += 1

    def write(self, _level: str, text: str) -> None:
        self.written.append(text)

    def start(self, name: str, *args: object, **kwargs: object) -> asyncio.Task[Any]:
        return asyncio.create_task(call(self.session, name, args, kwargs))

    async def __call__(self, name: str, *args: object, **kwargs: object) -> Any:
        task = self.start(name, *args, **kwargs)
        await self.clock.advance(0.0)
        for _ in range(20_000):
            if task.done():
                return task.result()
            await self.clock.advance(0.02)
        raise AssertionError(f"{name} did not return")


def field(record: object, path: str) -> Any:
    """``field(odometry, "pose.pose.position.x")``."""
    value: Any = record
    for name in path.split("."):
        value = value.fields[name]
    return value
