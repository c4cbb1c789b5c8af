"""Chassis pushes: which attributes go out, how often, and the clockwork that sends them (manual 3.2.3.8, 3.2.3.9)."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from roboglot.model.robot import Robot
from roboglot.protocols.robomaster import readings
from roboglot.wire.robomaster.replies import Number, Profile

RATE = 5  # Hz, until told otherwise

# The attributes in the manual's order. The position push carries no angle.
ATTRIBUTES: dict[str, Callable[[Robot], tuple[Number, ...]]] = {
    "position": lambda robot: readings.position(robot)[:2],
    "attitude": readings.attitude,
    "status": readings.status,
}


@dataclass(slots=True)
class _Attribute:
    read: Callable[[Robot], tuple[Number, ...]]
    rate: int = RATE
    task: asyncio.Task[None] | None = None


class Pushes:
    """One beat per attribute, each free of drift; ``send`` takes a finished datagram."""

    def __init__(self, robot: Robot, profile: Profile, send: Callable[[bytes], None]) -> None:
        self._robot = robot
        self._profile = profile
        self._send = send
        self._attributes = {name: _Attribute(read) for name, read in ATTRIBUTES.items()}

    def switch(self, name: str, on: bool | None, rate: int | None) -> None:
        """Turn the attribute on or off (None: leave it) and set its rate in Hz (None: leave it).

        Off also forgets its rate. Raises ComponentMissing if the robot has nothing to read it from.
        """
        attribute = self._attributes[name]
        if on:
            attribute.read(self._robot)
        running = attribute.task is not None if on is None else on
        wanted = rate or (RATE if on is False else attribute.rate)
        if attribute.task and (not running or wanted != attribute.rate):
            attribute.task.cancel()
            attribute.task = None
        attribute.rate = wanted
        if running and attribute.task is None:
            attribute.task = asyncio.get_running_loop().create_task(self._beat(name, attribute), name=f"push {name}")

    def reset(self) -> None:
        """Everything off, every rate at its default."""
        for name in self._attributes:
            self.switch(name, False, None)

    async def _beat(self, name: str, attribute: _Attribute) -> None:
        async for _ in self._robot.clock.every(1 / attribute.rate):
            self._send(self._profile.push("chassis", name, attribute.read(self._robot)))
