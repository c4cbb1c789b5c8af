"""Motions that the robot runs on its own: started without awaiting the reply, tracked until they arrive."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

from roboglot.drivers.robomaster.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.errors import Blocked
from roboglot.model.robot import Robot

PATIENCE = 1.5  # s without progress
PERIOD = 0.05  # s

Run = Callable[[], Awaitable[None]]


class Motions:
    """Motions of one component: starts them, and waits until they arrive."""

    def __init__(self, robot: Robot, supervisor: Supervisor) -> None:
        self._robot, self._supervisor = robot, supervisor

    def start(self, name: str, run: Run, halt: Run, *, resource: str, goal: object, source: str) -> Action:
        """Start an action that runs ``run`` and sends ``halt`` if that fails. Raises Unconnected."""
        self._supervisor.link.require()

        async def execute(_: Action) -> None:
            with robot_errors():
                try:
                    await run()
                except BaseException:
                    await halt()
                    raise

        return self._robot.actions.start(name, execute, resources={resource}, goal=goal, source=source)

    async def arrive(self, left: Callable[[], Awaitable[float]], good: float, what: str) -> None:
        """Wait until at most ``good`` is left. Raises Blocked without progress, Unconnected without a link."""
        clock = self._robot.clock
        best, best_at = math.inf, clock.time()
        while True:
            now = await left()
            if now <= good:
                return
            if now < best - good / 2:
                best, best_at = now, clock.time()
            elif clock.time() - best_at > PATIENCE:
                raise Blocked(f"{what} remains {now:.3g} off")
            self._supervisor.link.require()
            await clock.sleep(PERIOD)
