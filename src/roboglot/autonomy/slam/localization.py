"""The localization component, from Lidar and Odometry. The estimator that moves the belief is in slam.py."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from roboglot.autonomy.computing import computed
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.recovery.distant_places import NEAR, DistantPlaces
from roboglot.model.actions import Action
from roboglot.model.components.mapping.localization import LOCALIZATION, Localization, Region
from roboglot.model.errors import InvalidGoal, NotLocalized, NotReady
from roboglot.model.events import LostReason, PoseJumped, Rebooted
from roboglot.model.geometry import ORIGIN, POSITION_MAX, Pose, wrap_angle
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.autonomy.slam.matcher import Match
    from roboglot.autonomy.slam.slam import Slam

SEARCH_SECONDS = 10.0  # to search for a place that fits
AROUND_SECONDS = 60.0  # … including driving around, if allowed
SEARCH_PERIOD = 0.5  # s between two scans that are tried
AGAIN_SECONDS = 1.0  # s between two searches for a distant place: people who hide walls move on meanwhile


class LidarLocalization(Localization):
    """Localization; pure odometry until ``estimator`` is set, once loaded."""

    estimator: Slam | None = None

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot = robot
        self._belief = belief
        robot.events.listen(Rebooted, lambda _: self.enable(True))

    @property
    def pose(self) -> Pose:
        return self._belief.pose

    @property
    def quality(self) -> float:
        return self._belief.score

    @property
    def deviation(self) -> float | None:
        return self._belief.sigma if self.started else None

    @property
    def started(self) -> bool:
        return self.estimator is not None and self.estimator.started

    @property
    def lost(self) -> LostReason | None:
        return self._belief.lost if self._belief.localizing else None

    @property
    def enabled(self) -> bool:
        return self._belief.localizing

    def enable(self, on: bool) -> None:
        self._belief.localizing = on

    def set_pose(self, pose: Pose) -> None:
        if not (math.hypot(pose.x, pose.y) <= POSITION_MAX and math.isfinite(pose.yaw)):
            raise InvalidGoal(f"not a place on this map: {pose}")
        given = Pose(pose.x, pose.y, wrap_angle(pose.yaw))
        self._belief.take_pose(given)
        self._robot.events.publish(PoseJumped(stamp=self._robot.clock.time(), pose=given, given=True))

    def relocalize(self, region: Region | None = None, *, may_move: bool = False, source: str = "") -> Action:
        if region is not None and not (
            -POSITION_MAX <= region.min_x < region.max_x <= POSITION_MAX
            and -POSITION_MAX <= region.min_y < region.max_y <= POSITION_MAX
        ):
            raise InvalidGoal(f"not a region of this map: {region}")

        async def search(_action: Action) -> None:
            await (self._search_driving(region, source) if may_move else self._search_standing(region))

        return self._robot.actions.start("relocalize", search, resources={LOCALIZATION}, goal=region, source=source)

    async def _search_standing(self, region: Region | None) -> None:
        deadline, distant = self._robot.clock.time() + SEARCH_SECONDS, DistantPlaces()
        while True:
            found, odometry = await self._look(region)
            certain = len(found) == 1 and self._is_certain(found[0], odometry, distant)
            if certain and await self._settle(found[0], odometry):
                return
            if len(found) > 1:  # another scan from the same place adds nothing
                raise NotLocalized(f"{len(found)} places look alike to the lidar: drive to a place where they differ")
            if self._robot.clock.time() > deadline:
                if not self.started:
                    raise NotReady("localization is warming up: no scan has been compared with the map yet")
                raise NotLocalized("the scan fits nowhere on the map")
            await self._robot.clock.sleep(AGAIN_SECONDS if found else SEARCH_PERIOD)

    async def _search_driving(self, region: Region | None, source: str) -> None:
        """Search, and drive on while several places, or none, explain the scans. Raises NotReady, NotLocalized."""
        deadline = self._robot.clock.time() + AROUND_SECONDS
        while self.estimator is None:
            if self._robot.clock.time() > deadline:
                raise NotReady("localization is warming up: no scan has been compared with the map yet")
            await self._robot.clock.sleep(SEARCH_PERIOD)
        # needs the kernels, which are loaded by now
        from roboglot.autonomy.slam.recovery.look_around import Hypotheses, go_on

        hypotheses, distant = Hypotheses(), DistantPlaces()
        while self._robot.clock.time() <= deadline:
            found, odometry = await self._look(region)
            place = hypotheses.narrow(found, odometry)
            if place is not None:
                if not self._is_certain(place, odometry, distant):
                    await self._robot.clock.sleep(AGAIN_SECONDS)
                    continue
                if await self._settle(place, odometry):
                    return
                hypotheses = Hypotheses()
            if not await go_on(self._robot, self._belief.reader, source):
                await self._robot.clock.sleep(SEARCH_PERIOD)
        count = len(hypotheses.places)
        why = f"{count} places still look alike" if count else "the scan fits nowhere on the map"
        raise NotLocalized(f"{why} after {AROUND_SECONDS:g} s of looking around")

    async def _look(self, region: Region | None) -> tuple[list[Match], Pose]:
        """Return candidate poses (map) of the newest scan, and odometry (odom) at its time."""
        if self.estimator is None or (search := self.estimator.placing(region)) is None:
            return [], ORIGIN
        (odometry, work), grid = search, self._belief.map
        found = await computed(self._robot.clock, work)
        return found if self._belief.map is grid else [], odometry

    def _is_certain(self, place: Match, odometry: Pose, distant: DistantPlaces) -> bool:
        """Return whether to believe ``place``: far from the believed one, it must be found twice in a row."""
        believed = self._belief.map_to_odom.compose(odometry)
        return place.pose.distance_to(believed) < NEAR or distant.add(place.pose, odometry)

    async def _settle(self, place: Match, odometry: Pose) -> bool:
        """Believe ``place`` and match newer scans there; return whether they confirm it."""
        from roboglot.autonomy.slam.recovery.look_around import settle  # needs the kernels, which are loaded by now

        assert self.estimator is not None
        self.estimator.believe(place, odometry)
        stands = await settle(self._robot.clock, self.estimator, self._belief)
        self._robot.events.publish(PoseJumped(stamp=self._robot.clock.time(), pose=self._belief.pose))
        return stands
