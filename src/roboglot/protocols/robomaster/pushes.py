"""Chassis and gimbal pushes: their attributes, rates and timing (manual 3.2.3.8 to 3.2.4.9)."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import field
from itertools import groupby

from roboglot.model.clock import Clock
from roboglot.model.errors import RobotError
from roboglot.values import dataclass
from roboglot.wire.robomaster.replies import Number, Profile

RATE = 5  # Hz, by default
ROBOTS_TICK = 50  # Hz at which robots sample

Read = Callable[[], tuple[Number, ...]]


@dataclass(slots=True, eq=False)
class _Attribute:
    module: str
    name: str
    read: Read
    rate: int = RATE
    on: bool = False


@dataclass(slots=True, eq=False)
class _Beat:
    """Attributes sent with one period: each alone, or all of a module together, as on robots."""

    attributes: list[_Attribute]
    running: tuple[int, ...] = ()  # present rates
    task: asyncio.Task[None] | None = None


@dataclass(slots=True)
class Pushes:
    """Pushes at fixed periods, without drift; ``send`` gets complete datagrams."""

    clock: Clock
    profile: Profile
    send: Callable[[bytes], None]
    _beats: dict[tuple[str, str], _Beat] = field(default_factory=dict)
    _attributes: dict[tuple[str, str], _Attribute] = field(default_factory=dict)

    def offer(self, module: str, reads: Iterable[tuple[str, Read]]) -> None:
        """Declare a module's attributes in the order in which they are sent."""
        attributes = [_Attribute(module, name, read) for name, read in reads]
        for attribute in attributes:
            self._attributes[module, attribute.name] = attribute
        if self.profile.as_robots:
            together = _Beat(attributes)
            self._beats |= {(module, attribute.name): together for attribute in attributes}
        else:
            self._beats |= {(module, attribute.name): _Beat([attribute]) for attribute in attributes}

    def switch(self, module: str, name: str, on: bool | None, rate: int | None) -> None:
        """Turn the attribute on or off (None: leave it) and set its rate in Hz (None: leave it).

        Off also forgets its rate. Raises ComponentMissing if the robot has nothing to read it from.
        """
        attribute, beat = self._attributes[module, name], self._beats[module, name]
        if on:
            attribute.read()
        if on is not None:
            attribute.on = on
        attribute.rate = rate or (RATE if on is False else attribute.rate)
        rates = tuple(each.rate for each in beat.attributes if each.on)
        if beat.task and (not rates or (not self.profile.as_robots and rates != beat.running)):
            beat.task.cancel()
            beat.task = None
        beat.running = rates
        if rates and beat.task is None:
            tick = ROBOTS_TICK if self.profile.as_robots else attribute.rate
            beat.task = asyncio.get_running_loop().create_task(
                self._run(beat.attributes, tick), name=f"push {module} {name}"
            )

    def reset(self) -> None:
        """Switch everything off, every rate to its default."""
        for module, name in self._attributes:
            self.switch(module, name, False, None)

    async def _run(self, attributes: list[_Attribute], tick: int) -> None:
        start, last = self.clock.time(), 0
        async for now in self.clock.every(1 / tick):
            beat = round((now - start) * tick)  # not always the next
            due = [each for each in attributes if each.on and beat // (step := tick // each.rate) > last // step]
            last = beat
            for module, together in groupby(due, key=lambda each: each.module):
                if values := [(each.name, read) for each in together if (read := _reading(each)) is not None]:
                    self.send(self.profile.push(module, *values))


def _reading(attribute: _Attribute) -> tuple[Number, ...] | None:
    """Return the attribute's value; None while it is unknown, as when the link to a real robot is lost."""
    try:
        return attribute.read()
    except RobotError:
        return None
