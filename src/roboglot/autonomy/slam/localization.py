"""Localization from Lidar and Odometry: the component. The estimator that moves the belief is slam.py's."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from roboglot.autonomy.computing import computed
from roboglot.autonomy.slam.belief import Belief
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.mapping.localization import LOCALIZATION, Localization, Region
from roboglot.model.errors import InvalidGoal, NotLocalized, NotReady
from roboglot.model.events import LostReason, PoseJumped
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.autonomy.slam.slam import Slam

POSITION_MAX = 10_000.0  # m from the origin
SEARCH_SECONDS = 10.0  # that it looks for a place that fits
SEARCH_PERIOD = 0.5  # s between two scans that are tried


class LidarLocalization(Localization):
    """Pure odometry until the estimator runs, which is set as ``estimator`` when it is loaded."""

    estimator: Slam | None = None

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot = robot
        self._belief = belief

    @property
    def pose(self) -> Pose:
        return self._belief.pose

    @property
    def quality(self) -> float:
        return self._belief.quality

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

    def relocalize(self, region: Region | None = None, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        if region is not None and not (
            -POSITION_MAX <= region.min_x < region.max_x <= POSITION_MAX
            and -POSITION_MAX <= region.min_y < region.max_y <= POSITION_MAX
        ):
            raise InvalidGoal(f"no region of this map: {region}")

        async def run(_action: Action) -> None:
            deadline = self._robot.clock.time() + SEARCH_SECONDS
            while (count := await self._find(region)) != 1:
                if count > 1:  # another scan from the same place says no more
                    raise NotLocalized(f"{count} places look like what the lidar sees: drive to where they differ")
                if self._robot.clock.time() > deadline:
                    if not self.started:
                        raise NotReady("localization is warming up: no scan has been compared with the map yet")
                    raise NotLocalized("what the lidar sees fits nowhere")
                await self._robot.clock.sleep(SEARCH_PERIOD)

        return self._robot.actions.start(
            "relocalize", run, resources={LOCALIZATION}, goal=region, source=source, on_busy=on_busy
        )

    async def _find(self, region: Region | None) -> int:
        """Try the newest scan: how many places look like it; the only one is believed."""
        if self.estimator is None or (search := self.estimator.placing(region)) is None:
            return 0
        odometry, work = search
        found = await computed(self._robot.clock, work)
        if len(found) == 1:
            self.estimator.believe(found[0], odometry)
            self._robot.events.publish(PoseJumped(stamp=self._robot.clock.time(), pose=self._belief.pose))
        return len(found)
