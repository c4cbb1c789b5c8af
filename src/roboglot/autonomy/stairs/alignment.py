"""Alignment with stairs: drives to a place straight before the first step, while measuring its edge repeatedly.

Odometry bridges the measurements; neither a map nor a localized pose is needed.
"""

from __future__ import annotations

import math

from roboglot.autonomy.navigation.base_actions import PERIOD, stand_still, start_on_base
from roboglot.autonomy.stairs.finder import StepEdge
from roboglot.autonomy.stairs.ground_view import StairSight
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.motion.stair_alignment import (
    ALIGN_WITH_STAIRS,
    AlignmentStage,
    StairAlignment,
    StairDirection,
)
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Expired, NotFound
from roboglot.model.geometry import STILL, Pose, Twist, bounded, wrap_angle
from roboglot.model.robot import Robot

BEFORE = 0.3  # m between the hull's circle and the edge
LOOK_SECONDS, LOOKS_MIN = 1.5, 4  # until a step must have been seen; images collected at standstill
ALIGN_MAX = 30.0  # s from the first step to the end
BLIND_AFTER, LOST_AFTER = 0.3, 1.5  # s without sight of the edge before the robot stops, and before it gives up
SPEED, TURN_RATE = 0.15, 0.4  # m/s, rad/s at most
GAIN, TURN_GAIN = 1.5, 1.5  # 1/s
CLOSE, CLOSE_YAW = 0.008, math.radians(0.8)  # offset at which braking begins
GOOD, GOOD_YAW = 0.02, math.radians(2.0)  # offset accepted at standstill
SIDE, ASIDE = 0.35, 0.04  # m of the edge required on each side; the difference that is tolerated
SQUARE = math.radians(6.0)  # angle from which the left and right views can be compared


class SeenStairAlignment(StairAlignment):
    """Alignment by the time-of-flight sensors in front."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._sight = StairSight(robot)

    def align(self, direction: StairDirection, *, source: str = "") -> Action:
        robot = self._robot
        if (refusal := robot[Base].refusal) is not None:
            raise refusal
        if (Legs not in robot or robot[Legs].posture is Posture.STANDING) and not self._sight.hints(direction):
            raise NotFound(f"no step {direction} is visible ahead")

        async def run(action: Action) -> None:
            await _Approach(robot, self._sight, direction, action).run()

        return start_on_base(robot, ALIGN_WITH_STAIRS, run, goal=direction, source=source)


class _Approach:
    """One alignment under way; ``_goal``: base_link's goal (odom), ``_seen_at``: time of the last sighting, s."""

    def __init__(self, robot: Robot, sight: StairSight, direction: StairDirection, action: Action) -> None:
        self._robot, self._sight, self._direction, self._action = robot, sight, direction, action
        self._clock, self._base, self._odometry = robot.clock, robot[Base], robot[Odometry]
        self._goal = Pose()  # odom
        self._seen_at = -math.inf

    async def run(self) -> None:
        """Measure the edge, drive, and repeat until aligned. Raises NotFound, Expired."""
        self._action.report(AlignmentStage.LOOKING)
        self._sight.forget()
        await self._look_standing()
        self._action.report(AlignmentStage.ALIGNING)
        deadline = self._clock.time() + ALIGN_MAX
        while True:
            await self._go(deadline)
            await stand_still(self._robot)
            await self._look_standing()
            left = self._left()
            if math.hypot(left.x, left.y) <= GOOD and abs(left.yaw) <= GOOD_YAW:
                self._action.report(AlignmentStage.ALIGNED)
                return

    async def _look_standing(self) -> None:
        looks, deadline = 0, self._clock.time() + LOOK_SECONDS
        while looks < LOOKS_MIN or self._clock.time() - self._seen_at > BLIND_AFTER:
            if self._clock.time() >= deadline:
                raise NotFound(f"no step {self._direction} is visible ahead")
            looks += self._look()
            await self._clock.sleep(PERIOD)

    async def _go(self, deadline: float) -> None:
        """Drive until close enough to brake. Raises NotFound, Expired."""
        while True:
            held_at = self._clock.time()
            if await self._action.hold(self._brake):
                deadline += self._clock.time() - held_at
                self._seen_at = self._clock.time()
            self._look()
            unseen = self._clock.time() - self._seen_at
            if unseen > LOST_AFTER:
                raise NotFound("the step is out of sight")
            if self._clock.time() >= deadline:
                raise Expired(f"not aligned after {ALIGN_MAX:g} s")
            left = self._left()
            away = math.hypot(left.x, left.y)
            if away <= CLOSE and abs(left.yaw) <= CLOSE_YAW:
                return
            if unseen > BLIND_AFTER:
                self._brake()
            else:
                speed = min(SPEED, GAIN * away) / max(away, 1e-9)
                turn = bounded(TURN_GAIN * left.yaw, TURN_RATE)
                self._base.set_velocity(Twist(speed * left.x, speed * left.y, turn))
            await self._clock.sleep(PERIOD)

    def _look(self) -> bool:
        """Return whether there was a new reading; if it shows the edge, update the goal."""
        if not self._sight.look():
            return False
        if (edge := self._sight.find(self._direction)) is not None:
            self._seen_at = self._clock.time()
            self._goal = self._odometry.reading.pose.compose(self._place_before(edge))
        return True

    def _place_before(self, edge: StepEdge) -> Pose:
        """Return the goal in base_link: straight before the edge, centred on its visible part."""
        aside = (min(edge.left, SIDE) - min(edge.right, SIDE)) / 2
        if abs(edge.foot.yaw) > SQUARE or abs(aside) < ASIDE:
            aside = 0.0
        return edge.foot.compose(Pose(-self._robot.description.radius - BEFORE, aside))

    def _left(self) -> Pose:
        """Return the goal in base_link (m, rad)."""
        left = self._goal.relative_to(self._odometry.reading.pose)
        return Pose(left.x, left.y, wrap_angle(left.yaw))

    def _brake(self) -> None:
        self._base.set_velocity(STILL)
