"""The link to a real robot: its state, the age of its reports, the mover of the robot. Drivers update it."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

from roboglot.model.clock import Clock
from roboglot.model.components.component import Component
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.components.system.link_state import LinkState
from roboglot.model.errors import Busy, Refused, Unconnected
from roboglot.model.events import EventStream, LinkChanged
from roboglot.model.robot import Robot

__all__ = [
    "FAULT",
    "OTHERS",
    "STALE_AFTER",
    "US",
    "Link",
    "LinkState",
    "is_current",
    "require_current",
    "require_heard",
    "was_heard",
]

FAULT = "link lost"
US, OTHERS = "us", "another client"
STALE_AFTER = 0.5  # s without an update after which values count as old


class Link(Component):
    """Publishes ``LinkChanged``; while it is down, Health has a fault, by which every door shows it.

    ``address``: URL of the robot; ``name``: shown to clients instead, since options of the URL may name files.
    """

    def __init__(self, address: str, clock: Clock, events: EventStream, health: Health) -> None:
        self.address = address
        self.name = address.partition("?")[0]
        self._clock, self._events, self._health = clock, events, health
        self._state, self._reason, self._since = LinkState.CONNECTING, "", clock.time()
        self._heard: dict[str, float] = {}
        self._holder = ""
        self._stop_others: Callable[[], Awaitable[None]] | None = None
        self._report_health()

    @property
    def state(self) -> LinkState:
        """Current state."""
        return self._state

    @property
    def reason(self) -> str:
        """Reason why the link is not up, in plain words; empty if it is."""
        return self._reason

    @property
    def since(self) -> float:
        """Start of ``state``, robot time, s."""
        return self._since

    @property
    def holder(self) -> str:
        """Mover of the robot: ``US``, ``OTHERS``, or empty."""
        return self._holder

    def age(self, what: str = "") -> float:
        """Return the seconds since the last update of ``what`` ("pose", "battery" …), or of anything; inf: never."""
        heard = self._heard.get(what) if what else max(self._heard.values(), default=None)
        return float("inf") if heard is None else self._clock.time() - heard

    @property
    def ages(self) -> dict[str, float]:
        """Age of every kind of update received so far, s."""
        now = self._clock.time()
        return {what: now - heard for what, heard in self._heard.items()}

    @property
    def refusal(self) -> Unconnected | None:
        """Error that would refuse a command; None while commands reach the robot."""
        if self._state is LinkState.UP:
            return None
        return Unconnected(f"{self.name} is not connected: {self._reason or self._state}")

    def require(self) -> None:
        """Raise Unconnected unless a command would reach the robot now: commands never queue for a dead link."""
        if (refusal := self.refusal) is not None:
            raise refusal

    def require_free(self) -> None:
        """``require``, and raise Busy while another client moves the robot: a new action would end its motion."""
        self.require()
        if self._holder == OTHERS:
            raise Busy("another client moves the robot")

    async def take_back(self) -> None:
        """Stop another client's motion. Raises Refused if that is impossible, Unconnected without a link."""
        if self._holder != OTHERS:
            return
        self.require()
        if self._stop_others is None:
            raise Refused("cannot cancel: the motion belongs to another client of this robot")
        await self._stop_others()
        self.held_by("")

    # -- for the driver --

    def note_update(self, what: str) -> None:
        """Record an update of ``what`` now."""
        self._heard[what] = self._clock.time()

    def move_to(self, state: LinkState, reason: str = "") -> None:
        """Set the state."""
        if (state, reason) == (self._state, self._reason):
            return
        if state is not self._state:
            self._since = self._clock.time()
        self._state, self._reason = state, reason
        self._report_health()
        self._publish()

    def held_by(self, holder: str) -> None:
        """Set the mover of the robot, and publish a change."""
        if holder != self._holder:
            self._holder = holder
            self._publish()

    def stop_others_by(self, stop: Callable[[], Awaitable[None]]) -> None:
        """Set the function that stops another client's motion, or raises RobotError."""
        self._stop_others = stop

    def _publish(self) -> None:
        self._events.publish(LinkChanged(stamp=self._clock.time(), state=self._state, holder=self._holder))

    def _report_health(self) -> None:
        self._health.set(FAULT, False, "link", FaultLevel.ERROR)
        if self._state is not LinkState.UP:
            self._health.set(FAULT, True, "link", FaultLevel.ERROR, f"{self.name}: {self._reason or self._state}")


def was_heard(robot: Robot) -> bool:
    """Return False for a real robot that has not reported yet: its components hold initial values only."""
    return Link not in robot or not math.isinf(robot[Link].age())


def is_current(robot: Robot) -> bool:
    """Return False for a real robot without a link: where it was is known, but not how it moves now."""
    return was_heard(robot) and (Link not in robot or robot[Link].state is LinkState.UP)


def require_current(robot: Robot) -> None:
    """Raise Unconnected for a real robot without a link: its motion and its rates are unknown."""
    if Link in robot:
        robot[Link].require()


def require_heard(robot: Robot) -> None:
    """Raise Unconnected for a real robot that has not reported yet: neither pose nor battery is known.

    Reports from before the link was lost count; ``Link`` has their age.
    """
    if Link in robot and math.isinf(robot[Link].age()) and (refusal := robot[Link].refusal) is not None:
        raise refusal
