"""All doors of one robot: they open and close together, and whenever the robot switches on or off."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Sequence

from roboglot.hosting.closing import close_in_time
from roboglot.model.client_context import concerning
from roboglot.model.events import Rebooted, Rebooting, ShuttingDown
from roboglot.model.robot import Robot
from roboglot.protocols.door import Door, Endpoint

log = logging.getLogger(__name__)
LAST_WORDS = 0.2  # s to send outstanding answers before the robot switches off


class RobotDoors:
    """One robot's doors: opened and closed together, and whenever the robot itself switches on or off."""

    def __init__(self, robot: Robot, doors: Sequence[Door]) -> None:
        self._robot = robot
        self._doors = doors
        self._turn = asyncio.Lock()
        self._open = self._ended = False
        self._following: set[asyncio.Task[None]] = set()
        self._leave = [
            robot.events.listen(Rebooting, lambda _: self._follow(self._go_away())),
            robot.events.listen(ShuttingDown, lambda _: self._follow(self._go_away())),
            robot.events.listen(Rebooted, lambda _: self._follow(self._come_back())),
        ]

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """Addresses that the doors listen at."""
        return [endpoint for door in self._doors for endpoint in door.endpoints]

    def door(self, name: str) -> Door:
        """Return the door of a protocol. Raises LookupError."""
        found = next((door for door in self._doors if door.name == name), None)
        if found is None:
            raise LookupError(f"robot {self._robot.id} has no {name} door")
        return found

    async def open(self) -> None:
        """Open closed doors. Raises OSError with the address if it is taken."""
        async with self._turn:
            if not self._open and not self._ended:
                self._open = True
                with concerning(self._robot.id):
                    for door in self._doors:
                        await door.start()

    async def close(self) -> None:
        """Close the doors for good."""
        for leave in self._leave:
            leave()
        self._ended = True  # a robot coming up at this moment must not open doors that are closed for good
        await self._shut()

    async def _go_away(self) -> None:
        await asyncio.sleep(LAST_WORDS)
        log.info("robot %s is off: its doors are closed", self._robot.id)
        await self._shut()

    async def _come_back(self) -> None:
        try:
            await self.open()
        except OSError as error:
            log.error("robot %s is up again, but its doors did not open: %s", self._robot.id, error)

    async def _shut(self) -> None:
        async with self._turn:
            if self._open:
                self._open = False
                whose = f"robot {self._robot.id}"
                await asyncio.gather(
                    *(close_in_time(f"{whose}: the {door.name} door", door.close()) for door in self._doors)
                )

    def _follow(self, change: Coroutine[None, None, None]) -> None:
        task = asyncio.get_running_loop().create_task(change)
        self._following.add(task)
        task.add_done_callback(self._following.discard)
