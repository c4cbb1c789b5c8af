"""Moving aside for robots with right of way or face to face, and waiting until they have passed."""

from __future__ import annotations

import hashlib
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.base_actions import stand_still
from roboglot.autonomy.navigation.context import NavigationContext
from roboglot.autonomy.navigation.follower import PERIOD, Follower
from roboglot.autonomy.navigation.path_monitor import PathMonitor
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import NavigationOptions
from roboglot.model.errors import Unreachable
from roboglot.model.geometry import STILL

if TYPE_CHECKING:
    from roboglot.autonomy.navigation.route import Route

STANDS = 0.05  # m/s, or rad/s, up to which a robot stands
RULED_AFTER = 0.6  # s of standing in the way of a robot that goes first: a plan may lead around it meanwhile
FACED_AFTER, FACED_MORE = 3.0, 4.0  # s of standing face to face; the second is scaled by the robot's name
BACKS_OUT_AFTER = 1.0  # … in a narrow place, for the one with the shorter way back
FACED_MAX = 10  # moves aside per drive for an object that may not want to pass
ASIDE_MAX = 40  # per drive
GO_SECONDS, STUCK_SECONDS = 10.0, 2.0
WAIT_MIN, WAIT_MAX = 0.6, 12.0  # s in the waiting place
LOOK = 0.2  # s between two looks at the others while it waits
THERE = 0.08  # m from the waiting place
OLD_WAY = 2.5  # m of its route that must be free before it continues

Points = NDArray[np.float64]


class GivingWay:
    """Right of way of others during one drive: decides when to give way, and does so."""

    def __init__(self, context: NavigationContext, path_monitor: PathMonitor, action: Action) -> None:
        self._context, self._path_monitor, self._action = context, path_monitor, action
        self._robot, self._clock, self._traffic = context.robot, context.robot.clock, context.traffic
        self._ruled_since = self._faced_since = math.inf
        self._faced = self._asides = 0

    def is_due(self, follower: Follower) -> bool:
        """Return whether to move aside now; to be called at every step."""
        traffic = self._traffic
        stands = follower.speed < STANDS and follower.stop_at - follower.along < 0.4
        if not stands:
            self._ruled_since = self._faced_since = math.inf
            return False
        ruled = traffic.meeting is not None and traffic.meeting.stands_in_it
        return self._is_due(ruled, self._path_monitor.blocked and traffic.is_faced(self._context.belief.pose))

    def is_due_without_route(self) -> bool:
        """Return whether to give way without a route of its own: this robot may block the others' routes."""
        pose, traffic = self._context.belief.pose, self._traffic
        return self._is_due(traffic.is_in_the_way(pose), traffic.is_faced(pose))

    def _is_due(self, ruled: bool, faced: bool) -> bool:
        now = self._clock.time()
        self._ruled_since = min(self._ruled_since, now) if ruled else math.inf
        self._faced_since = min(self._faced_since, now) if faced else math.inf
        if self._asides >= ASIDE_MAX:
            return False
        if now - self._ruled_since > RULED_AFTER:
            return True
        if not faced or self._faced >= FACED_MAX:
            return False
        if now - self._faced_since > FACED_AFTER + FACED_MORE * chance(self._robot.id, self._faced):
            return True
        return now - self._faced_since > BACKS_OUT_AFTER and self._traffic.should_back_out(self._context.belief.pose)

    async def give_way(self, follower: Follower) -> float:
        """Move aside, and wait until the way is free, or for a while; return the metres driven."""
        carrot, beyond = follower.carrot()
        path = follower.route.ahead(self._context.belief.pose, carrot, beyond, OLD_WAY)
        ruled = self._ruled_since < math.inf
        try:
            aside = await self.go_aside(follower.top)
            follower.halt()
            if ruled:
                least, most = WAIT_MIN, WAIT_MAX
            else:
                least = WAIT_MIN + FACED_MORE * chance(self._robot.id, self._faced)
                most = FACED_AFTER + FACED_MORE
            await self._wait(path, least, most, ruled)
        finally:
            self._path_monitor.follower = follower
        return aside

    async def go_aside(self, top: float) -> float:
        """Leave the others' ways at up to ``top`` m/s, if there is room, and stop; return the metres driven."""
        pose, traffic = self._context.belief.pose, self._traffic
        ruled = self._ruled_since < math.inf
        self._asides += 1
        self._faced += not ruled
        ways = traffic.ways_to_clear() if ruled else [*traffic.ways_to_clear(), *traffic.ways_of_faced(pose)]
        self._ruled_since = self._faced_since = math.inf
        traffic.giving_way = True
        self._path_monitor.follower = None
        traffic.rest()
        try:
            route, aside = await self._route_aside(ways), 0.0
            if route is not None:
                follower = Follower(self._robot[Base].limits, top, route)
                await self._go(follower, ruled=ruled)
                aside = follower.along
            await stand_still(self._robot)
        finally:
            traffic.giving_way = False
            self._path_monitor.follower = None
        return aside

    async def _route_aside(self, ways: list[tuple[Points, float]]) -> Route | None:
        here = self._context.belief.pose.point
        place = await self._context.waiting_place(here, ways)
        if place is None:
            return None
        try:
            return await self._context.plan(here, (place,), NavigationOptions(tolerance=0.2))
        except Unreachable:
            return None

    async def _go(self, follower: Follower, *, ruled: bool) -> None:
        """Drive along the route while there is progress; ``ruled``: at most until no robot that goes first is near."""
        belief, base = self._context.belief, self._robot[Base]
        self._path_monitor.follower = follower
        begun = moved = due = self._clock.time()
        while (now := self._clock.time()) - begun < GO_SECONDS and now - moved < STUCK_SECONDS:
            if await self._action.hold(lambda: base.set_velocity(STILL)):
                return
            pose = belief.pose
            follower.locate(pose)
            if follower.last and pose.distance_to(follower.end) < THERE:
                return
            due = due if ruled and self._traffic.is_beside(pose) else now
            if now - due > RULED_AFTER:
                return
            if not self._path_monitor.monitors(follower) or belief.in_doubt:
                follower.stop_at = follower.along
            base.set_velocity(follower.command(pose))
            if follower.speed > STANDS or abs(follower.yaw_rate) > STANDS:
                moved = now
            await self._clock.sleep(PERIOD)

    async def _wait(self, path: Points, least: float, most: float, ruled: bool) -> None:
        """Wait ``least`` to ``most`` s until no other robot is about to use ``path``."""
        traffic, begun = self._traffic, self._clock.time()
        free_since = begun
        while True:
            await self._clock.sleep(LOOK)
            now = self._clock.time()
            if not traffic.is_in_the_way(self._context.belief.pose):
                free_since = now
            if now - begun > most or now - free_since > RULED_AFTER:
                return
            if now - begun > least and traffic.is_free(path, ruled=ruled):
                return


def chance(name: str, times: int) -> float:
    """Return a number from 0 to 1 by a robot's name and a count, different for robots face to face."""
    digest = hashlib.blake2b(f"{name} {times}".encode(), digest_size=4).digest()
    return int.from_bytes(digest, "big") / 2**32
