"""Postures, body poses, walks and figures of a dog: numbered motions with a result (1004).

Heartbeats report the current motion twice a second, but neither height nor attitude of the body.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence

from roboglot.clients.cyberdog import CyberDogClient, CyberDogRefused
from roboglot.clients.cyberdog.chapters.motion import STEP
from roboglot.drivers.cyberdog.chapters.motion.base import CyberDogBase
from roboglot.drivers.cyberdog.vocabulary import FIGURES, WALKS, posture_of, robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.feet import Foot, Footfall, FootState
from roboglot.model.components.motion.gaits import GAITS, Gait
from roboglot.model.components.motion.legs import (
    LEGS,
    BodyPose,
    Choreography,
    FootLift,
    LegLimits,
    Legs,
    Posture,
    Step,
    check_lift,
    check_pose,
)
from roboglot.model.components.motion.motions import Motion as Figure
from roboglot.model.errors import Refused
from roboglot.model.geometry import LEVEL, STILL, Orientation
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.chapters.motion.motion import Motion
from roboglot.wire.cyberdog.codes import InBandError

HEIGHTS = {Posture.STANDING: 0.22, Posture.LYING: 0.05, Posture.LIMP: 0.05}  # m, of the belly; not reported
LIMITS = LegLimits(
    lowest=0.10, highest=0.30, angle=0.45, shift=0.10, reach=0.15
)  # beyond these the dog refuses by itself, too
LONG_MAX = 90.0  # s: the longest dance, with some margin
LOOK = 0.5  # s between two heartbeats
POSE = 211  # an absolute body pose, in a given time


class CyberDogLegs(Legs):
    """Runs one motion at a time; only the emergency stop ends one early."""

    limits = LIMITS

    def __init__(self, robot: Robot, client: CyberDogClient, supervisor: Supervisor, base: CyberDogBase) -> None:
        self._robot, self._client, self._supervisor, self._base = robot, client, supervisor, base
        self._body = BodyPose()
        self._gait: Gait | None = None
        self._lift = FootLift(*STEP)
        self._changing = 0  # our motions in progress
        self.choreography = Choreography()

    @property
    def posture(self) -> Posture:
        beat = self._client.heartbeat
        if self._changing or beat is None:
            return Posture.CHANGING
        return posture_of(beat.motion_id)

    @property
    def body_height(self) -> float:
        posture = self.posture
        if posture is Posture.STANDING and self._body.height is not None:
            return self._body.height
        return HEIGHTS.get(posture, HEIGHTS[Posture.STANDING])

    @property
    def attitude(self) -> Orientation:
        return self._body.attitude if self.posture is Posture.STANDING else LEVEL

    @property
    def performing(self) -> Figure | None:
        beat = self._client.heartbeat
        return FIGURES.get(beat.motion_id) if beat and beat.motion_id != Motion.SIT_DOWN else None

    @property
    def gait(self) -> Gait | None:
        return self._gait

    @property
    def foot_lift(self) -> FootLift:
        return self._lift

    @property
    def feet(self) -> Mapping[Foot, FootState]:
        return {}

    def stand(self, *, source: str = "") -> Action:
        return self._start("stand up", Motion.STAND_UP, source=source)

    def lie_down(self, *, source: str = "") -> Action:
        return self._start("lie down", Motion.LIE_DOWN, source=source)

    def go_limp(self) -> None:
        for resource in (BASE, LEGS):
            for action in self._robot.actions.running(resource):
                action.cancel("emergency: the legs went limp")
        self._base.set_velocity(STILL)
        self._supervisor.send("emergency stop", self._client.emergency_stop(), always=True)

    def walk(self, gait: Gait | None, lift: FootLift | None = None) -> None:
        lift = lift or FootLift(*STEP)
        check_lift(lift)
        self._gait, self._lift = gait, lift
        self._base.motion = WALKS[gait] if gait else Motion.TROT_SLOW
        self._base.clamp = GAITS[gait].clamp if gait else None
        self._base.lift = (self._lift.front, self._lift.rear)

    def hold(self, body: BodyPose, *, duration: float = 1.0, relative: bool = False, source: str = "") -> Action:
        turned = (body.attitude.roll, body.attitude.pitch, body.attitude.yaw)
        shifted = (body.shift.x, body.shift.y, body.height or 0.0)
        check_pose(body, LIMITS, relative=relative)

        async def run(_: Action) -> None:
            if self.posture is not Posture.STANDING:
                raise Refused(f"the robot holds no pose while {self.posture}")
            motion = Motion.POSE_RELATIVE if relative else POSE
            await self._perform(motion, seconds=max(duration, 0.1), position=shifted, attitude=turned)
            self._body = BodyPose() if relative else body

        self._supervisor.link.require()
        return self._robot.actions.start("hold the body", run, resources=[LEGS], goal=body, source=source)

    def perform(self, motion: Figure, *, source: str = "") -> Action:
        number = next(number for number, figure in FIGURES.items() if figure is motion)
        return self._start(motion, number, source=source)

    def dance(self, steps: Sequence[Step], footfalls: Sequence[Footfall] = (), *, source: str = "") -> Action:
        raise Refused("this robot's app protocol has no choreographies")

    def _start(self, name: str, number: int, *, source: str) -> Action:
        self._supervisor.link.require()

        async def run(_: Action) -> None:
            await self._base.stop()
            self._body = BodyPose()
            await self._perform(number)

        resources = [LEGS, BASE]
        return self._robot.actions.start(name, run, resources=resources, goal=number, source=source)

    async def _perform(self, number: int, **how: object) -> None:
        """Run a motion to its end; follow the heartbeats if it outlasts the reply time-out."""
        perform: Callable[..., Awaitable[None]] = self._client.perform
        self._changing += 1
        try:
            with robot_errors():
                try:
                    await perform(number, **how)
                except CyberDogRefused as refused:
                    if refused.code != InBandError.TIMEOUT:
                        raise
                    await self._watch(number)
            await self._robot.clock.sleep(LOOK)  # until a heartbeat shows the result
        finally:
            self._changing -= 1

    async def _watch(self, number: int) -> None:
        begun = self._robot.clock.time()
        while (beat := self._client.heartbeat) and beat.motion_id == number:
            self._supervisor.link.require()
            if self._robot.clock.time() - begun > LONG_MAX:
                raise Refused("the motion does not end")
            await self._robot.clock.sleep(LOOK)
