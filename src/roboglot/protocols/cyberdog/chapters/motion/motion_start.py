"""Start of one motion on the model: walks, poses, dances, standing still. Knows neither its predecessor nor its end."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from roboglot.model.actions import Action
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.feet import Foot, Footfall, Foothold
from roboglot.model.components.motion.legs import BodyPose, FootLift, Legs, Step
from roboglot.model.geometry import STILL, Orientation, Twist
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.motion.climbing import WayAhead
from roboglot.protocols.cyberdog.chapters.motion.motion_table import FIGURES, POSES, SEEING, WALK_STANDS, WALKS
from roboglot.values import dataclass
from roboglot.wire.cyberdog.chapters.motion.motion import Motion

SOURCE = "cyberdog"
WATCHDOG = 0.2  # s without a servo frame after which the robot stops
PASSIVE_TROT = 1.0  # s of passive trot per result command
POSE_TIME = 0.5  # s to reach a body pose without a duration
LOOK = 0.1  # s between two checks ahead
PAW_LIFT = 0.08  # m
UPRIGHT = BodyPose()


@dataclass(frozen=True, slots=True)
class MotionRequest:
    """Parameters of a motion: velocity (base_link), body pose, seconds, foot lift."""

    velocity: Twist = STILL
    body: BodyPose = UPRIGHT
    seconds: float = 0.0
    lift: FootLift | None = None
    down: frozenset[Foot] = frozenset(Foot)  # the feet that stay on the floor


class MotionStart:
    """Starts motions of one robot."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._body = UPRIGHT  # requested by the last servo frame
        self._ahead = WayAhead(robot)
        self.standing = 0.0  # m: the belly's height when the robot last stood

    def walk(self, motion: int, request: MotionRequest, seconds: float, source: str) -> Action:
        """Walk at the requested velocity for ``seconds``."""
        if Legs in self._robot:
            self._robot[Legs].walk(WALKS[motion], self._lift(motion, request))
            if self._body == UPRIGHT:
                self.standing = self._robot[Legs].body_height
        return self._robot[Driving].drive(request.velocity, lifetime=seconds, source=source)

    def _lift(self, motion: int, request: MotionRequest) -> FootLift | None:
        return self._ahead.lift(request.lift) if motion in SEEING else request.lift

    async def _look_ahead(self, motion: int, request: MotionRequest) -> None:
        """Lift the feet over obstacles ahead, until cancelled."""
        async for _ in self._robot.clock.every(LOOK):
            self._robot[Legs].walk(WALKS[motion], self._lift(motion, request))

    def hold(self, body: BodyPose, *, relative: bool = False) -> None:
        """Walk or stand with the body in this pose; a repeated frame changes nothing."""
        if (relative or body != self._body) and Legs in self._robot:
            self._robot[Legs].hold(body, duration=WATCHDOG, relative=relative, source=SOURCE)
            self._body = body

    def looking(self, motion: int, request: MotionRequest) -> asyncio.Task[None] | None:
        """Return the terrain sensing of a motion that needs it; None for all others."""
        if motion not in SEEING or Legs not in self._robot:
            return None
        return asyncio.get_running_loop().create_task(self._look_ahead(motion, request), name="look ahead")

    def begin(self, motion: int, request: MotionRequest) -> Action | None:
        """Begin a motion; None: it was done at once."""
        robot = self._robot
        match motion:
            case Motion.EMERGENCY_STOP:
                self.stop()
                return None
            case Motion.STAND_UP if Legs not in robot:
                return None
            case _ if (action := self._posture(motion)) is not None:
                pass
            case Motion.USER_SEQUENCE:
                last = robot[Legs].choreography
                action = robot[Legs].dance(last.steps, last.footfalls, source=SOURCE)
            case Motion.USER_GAIT:
                step = Step(request.seconds or PASSIVE_TROT, request.velocity, lift=request.lift or FootLift())
                action = self._dance(step, robot[Legs].choreography.footfalls)
            case Motion.POSE_ONE_FOOT if len(request.down) < len(Foot):
                action = self._raise_foot(request)
            case _ if motion in POSES:
                relative, _ = POSES[motion]
                seconds = request.seconds or POSE_TIME
                action = robot[Legs].hold(request.body, duration=seconds, relative=relative, source=SOURCE)
            case _:
                action = self.walk(motion, request, request.seconds or PASSIVE_TROT, SOURCE)
        return action

    def _posture(self, motion: int) -> Action | None:
        """Begin a motion without parameters; None if ``motion`` takes some."""
        robot = self._robot
        if motion == Motion.STAND_UP:
            self._body = UPRIGHT
            return robot[Legs].stand(source=SOURCE)
        if motion in (Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE):
            return robot[Legs].lie_down(source=SOURCE)
        if motion in WALK_STANDS:
            return robot[Driving].drive(Twist(), lifetime=WATCHDOG, source=SOURCE)
        if motion in FIGURES:
            return robot[Legs].perform(FIGURES[motion], source=SOURCE)
        return None

    def _raise_foot(self, request: MotionRequest) -> Action:
        """Shift the body with the feet that are not ``down`` in the air, then stand straight."""
        legs, now = self._robot[Legs], self._robot[Legs].attitude
        by = request.body
        turned = Orientation(now.roll + by.attitude.roll, now.pitch + by.attitude.pitch, now.yaw + by.attitude.yaw)
        height = None if by.height is None else legs.body_height + by.height
        lift = request.lift.front if request.lift else PAW_LIFT
        step = Step(
            request.seconds, body=BodyPose(height, turned, by.shift), footholds=(Foothold(lift=lift),) * len(Foot)
        )
        return self._dance(step, [Footfall(request.seconds, request.down)])

    def _dance(self, step: Step, footfalls: Sequence[Footfall]) -> Action:
        """Dance one step; the choreography that 400 repeats stays unchanged."""
        legs = self._robot[Legs]
        users = legs.choreography
        try:
            return legs.dance([step], footfalls, source=SOURCE)
        finally:
            legs.choreography = users

    def stop(self) -> None:
        """Stop at once: the equivalent of going limp for a body without legs."""
        if Legs in self._robot:
            self._robot[Legs].go_limp()
        else:
            for action in self._robot.actions.running(BASE):
                action.cancel("emergency stop")
