"""Legs: the ways between postures take time, limp legs let the body sink, motions move the body and jump.

The body's attitude is held kinematically, jumps are ballistic flights in the physics. Walking itself is the base's.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Iterator, Sequence
from itertools import chain

from roboglot.model.actions import Action, ActionStatus, OnBusy
from roboglot.model.components.battery import Battery
from roboglot.model.components.driving import BASE
from roboglot.model.components.gaits import GAITS, Gait
from roboglot.model.components.legs import LEGS, STEPS_MAX, BodyPose, FootLift, LegLimits, Legs, Posture, Step
from roboglot.model.components.motions import MOTIONS, Motion, MotionSpec
from roboglot.model.components.motors import Motors
from roboglot.model.errors import Blocked, EmergencyStopped, InvalidGoal, Refused
from roboglot.model.events import PostureChanged
from roboglot.model.geometry import STILL, Orientation
from roboglot.model.robot import Robot
from roboglot.model.sensing import Supply
from roboglot.simulation.body import Legs as LegsSection
from roboglot.simulation.components.base import SimulatedBase
from roboglot.simulation.holding import added, check_lift, check_pose, led
from roboglot.simulation.hull import GRAVITY, Hull
from roboglot.simulation.performing import (
    Body,
    Frame,
    Performance,
    Stance,
    dance_frames,
    fall,
    motion_frames,
    straighten,
    strayed,
)

LOOK = 0.02  # s between looks at whether a motion has ended
TURN_RATE = 1.2  # rad/s at which the body straightens on its way between postures
OWN_GAIT_AFTER = 1.0  # s of standing still until the robot walks its own way again
LANDED = 0.02  # m above the floor
STEP_SECONDS_MAX = 60.0


class _Track:
    """A body on its way from one way of being held to another."""

    def __init__(self, start: Body, goal: Body, seconds: float) -> None:
        self._start, self._goal, self._seconds = start, goal, max(seconds, 1e-9)
        self._gone = 0.0
        self.halted = False

    @property
    def over(self) -> bool:
        return self._gone >= self._seconds

    def advance(self, seconds: float) -> Body:
        """The body after that much more time."""
        self._gone = min(self._seconds, self._gone + (0.0 if self.halted else seconds))
        return self._start.towards(self._goal, self._gone / self._seconds)


class SimulatedLegs(Legs):
    """Holds the torso; walks at the pace of the base, leaps in the physics."""

    def __init__(self, section: LegsSection, hull: Hull, base: SimulatedBase, robot: Robot, tick: float) -> None:
        self._section, self._hull, self._base, self._robot = section, hull, base, robot
        self._clock = robot.clock
        self.limits = LegLimits(
            lowest=section.lowest, highest=section.highest, angle=section.angle_max, shift=section.shift_max
        )
        self._posture = Posture.STANDING
        self._straight = Body(section.standing)
        self._body = self._taken = self._straight
        self._stance = Stance(
            self._straight, min(section.lying, section.lowest), max(section.standing, section.highest), tick
        )
        self._track: _Track | None = None
        self._performance: Performance | None = None
        self._performing: Motion | None = None
        self._gait: Gait | None = section.gait
        self._lift = FootLift()
        self._still = self._strides = 0.0
        self.off = ""  # why the motors have no power; empty: they have
        hull.put_belly(section.standing)
        self.walk(section.gait)

    @property
    def posture(self) -> Posture:
        return self._posture

    @property
    def body_height(self) -> float:
        return self._hull.belly

    @property
    def attitude(self) -> Orientation:
        return self._hull.attitude

    @property
    def performing(self) -> Motion | None:
        return self._performing

    @property
    def gait(self) -> Gait | None:
        return self._gait

    @property
    def foot_lift(self) -> FootLift:
        return self._lift

    # -- postures ----------------------------------------------------------------------------------------------------

    def stand(self, *, source: str = "") -> Action:
        async def run(action: Action) -> None:
            if self._posture is not Posture.STANDING or self._body != self._straight:
                await self._move(action, Posture.STANDING, self._section.standing, self._section.stand_time)

        there = self._posture is Posture.STANDING and self._body == self._straight and self._track is None
        return self._start("stand up", run, there, Posture.STANDING, source)

    def lie_down(self, *, source: str = "") -> Action:
        async def run(action: Action) -> None:
            if self._posture is Posture.LIMP:
                raise EmergencyStopped("limp legs can only stand up")
            if self._posture is not Posture.LYING:
                await self._move(action, Posture.LYING, self._section.lying, self._section.lie_time)

        return self._start("lie down", run, self._posture is Posture.LYING, Posture.LYING, source)

    def go_limp(self) -> None:
        for resource in (BASE, LEGS):
            for action in self._robot.actions.running(resource):
                action.cancel("emergency: the legs went limp")
        self._performance = self._track = None
        self._base.cut()
        self._hull.hold_belly(None)
        self._become(Posture.LIMP)

    def _start(self, name: str, run: Callable[[Action], Awaitable[None]], there: bool, goal: object, by: str) -> Action:
        # Who is there already disturbs nobody who drives.
        return self._robot.actions.start(name, run, resources=[LEGS] if there else [LEGS, BASE], goal=goal, source=by)

    async def _move(self, action: Action, wanted: Posture, height: float, duration: float) -> None:
        """Brake, then bring the torso there; cancelled, it stays where it is, between the postures."""
        if self.off:
            raise Refused(self.off)
        await self._brake()
        goal = Body(height)
        self._body = self._found()
        pace = (self._section.standing - self._section.lying) / duration
        seconds = max(abs(goal.height - self._body.height) / pace, self._body.turn_to(goal) / TURN_RATE)
        self._become(Posture.CHANGING)
        await self._follow(action, _Track(self._body, goal, seconds))
        self._become(wanted)

    def _found(self) -> Body:
        """How the body is held now; who lies on a side rolls back onto the feet from there."""
        hull = self._hull
        held = Body(hull.belly, hull.attitude, hull.shift)
        if hull.overturned:
            held = Body(hull.belly, Orientation(roll=hull.tilt[0]), hull.shift)
            hull.overturn(0.0)
        return held

    async def _follow(self, action: Action, track: _Track) -> None:
        """Until the body is there, or for ever if somebody else moves it now."""
        self._track = track

        def halt() -> None:
            track.halted = True

        try:
            while not track.over:
                await self._clock.sleep(LOOK)
                await action.hold(halt)
                track.halted = False
        finally:
            if self._track is track:
                self._track = None

    async def _brake(self) -> None:
        """Return when the wheels stand still; who cancels meanwhile finds the robot standing as before."""
        self._base.lock(LEGS, "the robot changes its posture")
        try:
            while self._base.velocity != STILL:
                await self._clock.sleep(LOOK)
        except BaseException:
            if self._posture is Posture.STANDING:
                self._base.unlock(LEGS)
            raise

    def _become(self, posture: Posture) -> None:
        if posture is self._posture:
            return
        self._posture = posture
        if posture is Posture.STANDING:
            self._base.unlock(LEGS)
        else:
            self._base.lock(LEGS, f"the robot cannot drive while {posture}")
        self._robot.events.publish(PostureChanged(stamp=self._clock.time(), posture=posture))

    # -- how the body is held, how it walks --------------------------------------------------------------------------

    def hold(self, body: BodyPose, *, duration: float = 1.0, relative: bool = False, source: str = "") -> Action:
        if not 0.0 <= duration <= STEP_SECONDS_MAX:
            raise InvalidGoal(f"a body pose takes at most {STEP_SECONDS_MAX:g} s")
        if relative:
            body = added(self._body, body, self.limits)
        check_pose(body, self.limits)

        async def run(action: Action) -> None:
            if self._posture is not Posture.STANDING:
                raise Refused(f"the robot holds no pose while {self._posture}")
            height = self._body.height if body.height is None else body.height
            goal = Body(height, body.attitude, body.shift)
            await self._follow(action, _Track(self._body, goal, max(duration, self._body.turn_to(goal) / 4.0)))

        return self._robot.actions.start("hold the body", run, resources=[LEGS], goal=body, source=source)

    def walk(self, gait: Gait | None, lift: FootLift | None = None) -> None:
        lift = lift or FootLift()
        check_lift(lift)
        gait = gait or self._section.gait
        self._still = 0.0
        if (gait, lift) != (self._gait, self._lift) or gait is not None:
            self._gait, self._lift = gait, lift
            self._base.walk(GAITS[gait].clamp if gait else None)
            self._step_over(None)

    def _step_over(self, lowest: float | None) -> None:
        """What is lower passes under the body; None: as it walks. A body on wheels has its own clearance."""
        walking = min(self._lift.front, self._lift.rear) if self._gait else self._hull.body.hull.clearance
        self._hull.step_over(walking if lowest is None or not self._gait else lowest)

    # -- motions -----------------------------------------------------------------------------------------------------

    def perform(self, motion: Motion, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        spec = MOTIONS[motion]

        async def run(action: Action) -> None:
            self._check_ready(spec.before)
            await self._play(action, motion, lambda: motion_frames(spec, self._body, self._stance), spec)

        return self._robot.actions.start(
            motion, run, resources=[LEGS, BASE], goal=motion, source=source, on_busy=on_busy
        )

    def dance(self, steps: Sequence[Step], *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        if len(steps) > STEPS_MAX:
            raise InvalidGoal(f"a choreography has at most {STEPS_MAX} steps")
        for step in steps:
            check_pose(step.body, self.limits)
            check_lift(step.lift)
            if not 0.0 <= step.seconds <= STEP_SECONDS_MAX or step.twist.clamped(self._base.limits.twist) != step.twist:
                raise InvalidGoal("a step is too long or too fast")

        async def run(action: Action) -> None:
            self._check_ready(frozenset({Posture.STANDING}))
            await self._play(action, None, lambda: dance_frames(steps, self._body, self._stance), None)

        return self._robot.actions.start(
            "dance", run, resources=[LEGS, BASE], goal=tuple(steps), source=source, on_busy=on_busy
        )

    def _check_ready(self, before: frozenset[Posture]) -> None:
        if self._posture not in before:
            raise Refused(f"the robot is {self._posture}; this begins {' or '.join(sorted(before))}")
        getting_up = Posture.LYING in before
        if self.off:
            raise Refused(self.off)
        if self._hull.hand is not None:
            raise Refused("somebody holds the robot up")
        if self._hull.overturned and not getting_up:
            raise Refused("the robot lies on its side")
        if Motors in self._robot and self._robot[Motors].hottest > self._robot[Motors].hot:
            raise Refused("a motor is too hot")
        if Battery not in self._robot or getting_up:
            return
        battery = self._robot[Battery].state
        if battery.percentage <= self._section.tired_below:
            raise Refused("the battery is too low for this")
        if battery.supply is Supply.WIRE:
            raise Refused("the robot is charging by wire")

    async def _play(
        self, action: Action, motion: Motion | None, make: Callable[[], Iterator[Frame]], spec: MotionSpec | None
    ) -> None:
        """Brake, perform to the end, and see where one is. Given up, the body lands and straightens itself."""
        await self._brake()
        self._body = self._found()
        self._become(Posture.CHANGING)
        begin = self._hull.pose
        performance = self._performance = Performance(make())
        self._performing = motion
        try:
            await self._until_over(performance)
        except asyncio.CancelledError:
            if action.status is ActionStatus.CANCELING:  # otherwise the loop is closing and its clock may stand still
                self._give_up(performance)
                await self._until_over(performance)
            raise
        finally:
            self._performing = None
            if self._performance is performance:
                self._performance = None
                self._base.carry(STILL)
                straight = performance.hit or action.status is ActionStatus.CANCELING or spec is None
                self._become(Posture.STANDING if straight or spec is None else spec.after)
        if performance.hit or (spec and strayed(self._hull.pose, begin.compose(spec.way))):
            raise Blocked("something stood in the way")

    async def _until_over(self, performance: Performance) -> None:
        while not performance.over and self._performance is performance:
            await self._clock.sleep(LOOK)

    def _give_up(self, performance: Performance) -> None:
        """Land if need be, then straighten."""
        coming_down: Iterator[Frame] = iter(())
        if performance.frame and performance.frame.airborne:
            self._hull.stop()
            drop = max(0.0, self._hull.rise) + max(0.0, self._hull.motion[2]) ** 2 / (2 * GRAVITY)
            seconds = math.sqrt(2 * drop / GRAVITY) + max(0.0, self._hull.motion[2]) / GRAVITY
            coming_down = fall(self._body, self._stance, seconds)
            performance.frames = chain(coming_down, straighten(self._straight, self._stance))
        else:
            performance.frames = straighten(self._body, self._stance)

    # -- every tick --------------------------------------------------------------------------------------------------

    def control(self, seconds: float) -> None:
        """Before the physics: move the torso's set point on, and base_link while performing."""
        if self._performance:
            self._play_frame(self._performance)
            self._hull.effort = self._section.perform_power
            return
        if self._track:
            self._body = self._track.advance(seconds)
        if self._posture is Posture.STANDING:
            self._walk_on(seconds)
        elif self._track:
            self._take(self._body)

    def _play_frame(self, performance: Performance) -> None:
        frame = performance.frame
        if frame and not performance.hit and _in_the_way(self._hull, frame):
            performance.hit = True
            self._give_up(performance)
        performance.frame = frame = next(performance.frames, None)
        if frame is None:
            performance.over = True
            self._base.carry(STILL)
            return
        self._base.carry(frame.twist)
        if frame.lift != performance.lift:
            performance.lift = frame.lift
            self._step_over(frame.lift)
        if frame.leap:
            self._hull.leap(frame.twist.x, frame.twist.y, frame.twist.yaw, frame.leap)
        elif frame.landed:
            self._hull.stop()
        self._body = frame.body
        self._take(frame.body, weightless=frame.airborne)

    def _walk_on(self, seconds: float) -> None:
        """The body swings with the gait; whoever stands for a while walks its own way again."""
        velocity, gait, body = self._base.velocity, self._gait, self._body
        on_a_leash = gait is Gait.TROT_PASSIVE
        if on_a_leash and self._hull.leash and not (self._base.locked or self._robot.actions.running(BASE)):
            self._base.set_velocity(led(self._hull.leash, self._hull.turned))
        if velocity is STILL or velocity == STILL:
            self._still += 0.0 if on_a_leash else seconds
            if self._still >= OWN_GAIT_AFTER:
                self.walk(None)
            self._hull.effort = 0.0
        elif gait is not None:
            spec, self._still = GAITS[gait], 0.0
            self._strides += spec.steps * seconds
            share = min(1.0, (velocity.speed + 0.2 * abs(velocity.yaw)) / 0.1)
            swing, a = share * math.sin(math.tau * self._strides), body.attitude
            body = self._stance.at(
                body.height + spec.bounce * swing, Orientation(a.roll, a.pitch + spec.rock * swing, a.yaw), body.shift
            )
            lift = (self._lift.front + self._lift.rear) / 2
            self._hull.effort = self._hull.body.hull.mass * GRAVITY * lift * spec.steps
        if body is not self._taken and body != self._taken:
            self._take(body)

    def _take(self, body: Body, *, weightless: bool = False) -> None:
        self._taken = body
        self._hull.hold_belly(body.height, weightless=weightless)
        self._hull.attitude, self._hull.shift = body.attitude, body.shift


def _in_the_way(hull: Hull, frame: Frame) -> bool:
    """Whether something touches the hull where it goes."""
    return any(touch.x * frame.twist.x + touch.y * frame.twist.y > 0.0 for touch in hull.touches)
