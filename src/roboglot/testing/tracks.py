"""True start poses and tracks of a test's robots."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from roboglot.model.clock import Clock, LockstepClock

if TYPE_CHECKING:
    from roboglot.fleet import Fleet
    from roboglot.model.geometry import Pose

LOOK_AGAIN = 0.05  # s of robot time between two checks of a condition
TRACK_PERIOD = 0.2  # s of robot time between two points of a track


async def pass_time(clock: Clock, seconds: float) -> None:
    """Let ``seconds`` of robot time pass: in lockstep as fast as possible, else at the clock's speed.

    Raises ValueError if negative.
    """
    if not seconds >= 0.0:
        raise ValueError("time does not go back")
    await (clock.advance(seconds) if isinstance(clock, LockstepClock) else clock.sleep(seconds))


class Ways:
    """``origins``: true start pose of each robot; ``tracks``: points of its true way (m, world), for the picture.

    Use everything else in the robots' thread only.
    """

    def __init__(self) -> None:
        self.origins: dict[str, Pose] = {}
        self.tracks: dict[str, list[tuple[float, float]]] = {}
        self._starts: dict[str, Pose] = {}  # the first believed pose of each
        self._fleet: Fleet
        self._clock: Clock
        self._tracking: asyncio.Task[None] | None = None

    def begin(self, fleet: Fleet, clock: Clock) -> None:
        """Remember the poses of the robots of ``fleet`` before it starts."""
        self._fleet, self._clock = fleet, clock
        self.origins = {placed.name: placed.pose for placed in fleet.world.stage.robots}

    async def wait_for_places(self) -> None:
        """Wait until each mapping robot has a map, and remember its estimated pose."""
        from roboglot.model.components.mapping.localization import Localization
        from roboglot.model.components.mapping.mapping import Mapping

        for name, robot in self._fleet.robots.items():
            if Localization in robot and Mapping in robot:
                while not robot[Mapping].grid.width:
                    await pass_time(self._clock, LOOK_AGAIN)
                self._starts[name] = robot[Localization].pose

    def follow(self) -> None:
        """Begin to record tracks."""
        self._tracking = asyncio.ensure_future(self._track())

    async def put_back(self) -> None:
        """Return the robots to their start poses, charge and pose estimates."""
        from roboglot.model.components.mapping.localization import Localization
        from roboglot.model.components.system.resetting import reset

        for name, robot in self._fleet.robots.items():
            if name in self.origins:
                await reset(robot, self._fleet.world.stage, robot.actions.cancel)
            if name in self._starts:
                robot[Localization].set_pose(self._starts[name])

    def clear(self) -> None:
        """Forget the tracks."""
        for track in self.tracks.values():
            track.clear()

    async def _track(self) -> None:
        while True:
            for placed in self._fleet.world.stage.robots:
                track = self.tracks.setdefault(placed.name, [])
                here = (round(placed.pose.x, 3), round(placed.pose.y, 3))
                if not track or track[-1] != here:
                    track.append(here)
            await self._clock.sleep(TRACK_PERIOD)
