"""Legs: changes of posture take time, limp legs let the body sink, motions move the body and jump.

The body's attitude is kinematic, jumps are ballistic flights in the physics. Walking itself is the base's.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import suppress

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.feet import Foot, Footfall, FootState
from roboglot.model.components.motion.gaits import GAITS, Gait
from roboglot.model.components.motion.legs import (
    LEGS,
    BodyPose,
    Choreography,
    FootLift,
    Legs,
    Posture,
    Step,
    check_lift,
    check_pose,
)
from roboglot.model.components.motion.motions import MOTIONS, Motion, MotionSpec
from roboglot.model.errors import Collided, EmergencyStopped, InvalidGoal, Refused
from roboglot.model.events import PostureChanged, Rebooted
from roboglot.model.geometry import STILL, Orientation
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.body import LegsSection
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.performing import (
    Body,
    MotionTick,
    Performance,
    Stance,
    Track,
    dance_frames,
    motion_frames,
    strayed,
)
from roboglot.simulation.bodies.posture_limits import STEP_SECONDS_MAX, added, check_steps, led
from roboglot.simulation.bodies.readiness import check_fit
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.bodies.steps import Steps
from roboglot.simulation.bodies.torso import Torso
from roboglot.simulation.bodies.walking_body import check_posture, held_body, swayed, walking_effort
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.motion_player import MotionPlayer

LOOK = 0.02  # s between checks whether a motion has ended
TURN_RATE = 1.2  # rad/s at which the body straightens between postures
OWN_GAIT_AFTER = 1.0  # s of standstill after which the robot returns to its own gait


class SimulatedLegs(Legs):
    """Legs that hold the torso, walk at the base's velocity, and leap in the physics."""

    def __init__(self, section: LegsSection, hull: Hull, base: SimulatedBase, robot: Robot, tick: float) -> None:
        self._section, self._hull, self._base, self._robot = section, hull, base, robot
        self._clock = robot.clock
        self.limits = section.limits
        self._posture = Posture.STANDING
        self._torso = torso = Torso(hull, Body(section.standing))
        self._stance = Stance(
            torso.straight, min(section.lying, section.lowest), max(section.standing, section.highest), tick
        )
        self._performing: Motion | None = None
        self._still = 0.0  # s since it stopped walking
        self.duty = Duty(on=True)  # while the torso or the feet move
        self._steps = Steps(section, hull)
        self._player = MotionPlayer(hull, base, torso, self._steps, self._stance)
        self.choreography = Choreography()
        self.off = ""  # why the motors lack power; empty: they have it
        torso.put(section.standing)
        self.walk(section.gait)

        def power_up(_: Rebooted) -> None:
            """Give limp legs their torque again, as every start of a robot does: they lie."""
            if self._posture is Posture.LIMP:
                torso.body = lying = Body(section.lying)
                torso.take(lying)
                self._become(Posture.LYING)

        robot.events.listen(Rebooted, power_up)

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
        return self._steps.gait

    @property
    def foot_lift(self) -> FootLift:
        return self._steps.lift

    @property
    def feet(self) -> Mapping[Foot, FootState]:
        feet = self._steps.feet
        return feet.states(self._hull.pose) if feet else {}

    # -- postures --

    def stand(self, *, source: str = "") -> Action:
        async def run(action: Action) -> None:
            if self._posture is not Posture.STANDING or not self._torso.is_straight:
                await self._move(action, Posture.STANDING, self._section.standing, self._section.stand_time)

        there = self._posture is Posture.STANDING and self._torso.is_straight and not self._torso.track
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
        self._player.performance = self._torso.track = None
        self._base.cut()
        self._torso.let_sink()
        self._become(Posture.LIMP)

    def reset(self) -> None:
        """Stand straight at once, as at the world's start."""
        self._player.performance = self._torso.track = None
        self._torso.put(self._section.standing)
        self._torso.body = self._torso.straight
        self._torso.take(self._torso.straight)
        self._become(Posture.STANDING)

    def _start(self, name: str, run: Callable[[Action], Awaitable[None]], there: bool, goal: object, by: str) -> Action:
        # A body already in that posture does not interrupt a drive.
        return self._robot.actions.start(
            name, run, resources=[LEGS] if there else [LEGS, BASE], goal=goal, source=by, pausable=True
        )

    async def _move(self, action: Action, wanted: Posture, height: float, duration: float) -> None:
        """Brake, then move the torso to ``height`` (m) in ``duration`` (s); if cancelled, it stays between postures."""
        if self.off:
            raise Refused(self.off)
        await self._brake()
        goal = Body(height)
        self._torso.body = held = held_body(self._hull)
        pace = (self._section.standing - self._section.lying) / duration
        seconds = max(abs(goal.height - held.height) / pace, held.turn_to(goal) / TURN_RATE)
        self._become(Posture.CHANGING)
        self.duty.begin()
        await self._torso.follow(Track(held, goal, seconds), action, self._clock, LOOK)
        self._become(wanted)

    async def _brake(self) -> None:
        """Lock the base and wait until its wheels stand still; if cancelled while standing, unlock it again."""
        self._base.locks.lock(LEGS, "the robot changes its posture")
        try:
            while self._base.velocity != STILL:
                await self._clock.sleep(LOOK)
        except BaseException:
            if self._posture is Posture.STANDING:
                self._base.locks.unlock(LEGS)
            raise

    def _become(self, posture: Posture) -> None:
        if posture is self._posture:
            return
        self._posture = posture
        self.duty.begin()
        if posture is Posture.STANDING:
            self._base.locks.unlock(LEGS)
        else:
            self._base.locks.lock(LEGS, f"the robot cannot drive while {posture}")
        self._robot.events.publish(PostureChanged(stamp=self._clock.time(), posture=posture))

    # -- pose and gait of the body --

    def hold(self, body: BodyPose, *, duration: float = 1.0, relative: bool = False, source: str = "") -> Action:
        if not 0.0 <= duration <= STEP_SECONDS_MAX:
            raise InvalidGoal(f"a body pose takes at most {STEP_SECONDS_MAX:g} s")
        if relative:
            body = added(self._torso.body, body, self.limits)
        check_pose(body, self.limits)

        async def run(action: Action) -> None:
            if self._posture is not Posture.STANDING:
                raise Refused(f"the robot holds no pose while {self._posture}")
            held = self._torso.body
            goal = Body(held.height if body.height is None else body.height, body.attitude, body.shift)
            track = Track(held, goal, max(duration, held.turn_to(goal) / 4.0))
            self.duty.begin()
            await self._torso.follow(track, action, self._clock, LOOK)

        return self._robot.actions.start(
            "hold the body", run, resources=[LEGS], goal=body, source=source, pausable=True
        )

    def walk(self, gait: Gait | None, lift: FootLift | None = None) -> None:
        lift = lift or FootLift()
        check_lift(lift)
        gait = gait or self._section.gait
        self._still = 0.0
        if (gait, lift) != (self._steps.gait, self._steps.lift) or gait is not None:
            self.duty.begin()
            self._base.walk(GAITS[gait].clamp if gait else None)
            self._steps.walk(gait, lift)

    # -- motions --

    def perform(self, motion: Motion, *, source: str = "") -> Action:
        spec = MOTIONS[motion]

        async def run(action: Action) -> None:
            self._check_ready(spec.before)
            await self._play(action, motion, lambda: motion_frames(spec, self._torso.body, self._stance), spec)

        return self._robot.actions.start(motion, run, resources=[LEGS, BASE], goal=motion, source=source, pausable=True)

    def dance(self, steps: Sequence[Step], footfalls: Sequence[Footfall] = (), *, source: str = "") -> Action:
        check_steps(steps, footfalls, self.limits, self._base.limits.twist)
        self.choreography = Choreography(tuple(steps), tuple(footfalls))
        falls = footfalls if self._steps.feet else ()  # there are no feet to lift while rolling

        async def run(action: Action) -> None:
            self._check_ready(frozenset({Posture.STANDING}))
            await self._play(action, None, lambda: dance_frames(steps, self._torso.body, self._stance, falls), None)

        return self._robot.actions.start(
            "dance", run, resources=[LEGS, BASE], goal=tuple(steps), source=source, pausable=True
        )

    def _check_ready(self, before: frozenset[Posture]) -> None:
        check_posture(self._posture, before, self.off)
        check_fit(self._robot, self._hull, self._section.tired_below, getting_up=Posture.LYING in before)

    async def _play(
        self, action: Action, motion: Motion | None, make: Callable[[], Iterator[MotionTick]], spec: MotionSpec | None
    ) -> None:
        """Brake, perform, and check the final place. If cancelled, land and straighten. Raises Collided."""
        await self._brake()
        self._torso.body = held_body(self._hull)
        self._become(Posture.CHANGING)
        begin = self._hull.pose
        performance, self._performing = Performance(make()), motion
        self.duty.begin()
        try:
            await self._player.perform(performance, action, self._clock, LOOK)
        except asyncio.CancelledError:
            if action.status is ActionStatus.CANCELING:  # otherwise the loop is closing and its clock may stand still
                self._player.give_up(performance)
                await self._player.until_over(performance, self._clock, LOOK)
            raise
        finally:
            self._performing = None
            if self._player.performance is performance:
                self._player.performance = None
                self._base.carry(STILL)
                straight = performance.hit or action.status is ActionStatus.CANCELING or spec is None
                self._become(Posture.STANDING if straight or spec is None else spec.after)
        if performance.hit or (spec and strayed(self._hull.pose, begin.compose(spec.way))):
            raise Collided("an obstacle was in the way")

    # -- every tick --

    def control(self, seconds: float) -> None:
        """Move torso and feet, and base_link while performing; before the physics."""
        torso = self._torso
        if performance := self._player.performance:
            self._player.play(performance)
            self._steps.step(self._base.velocity, seconds, performance.frame)
            self._hull.effort = self._section.perform_power
            return
        if torso.track:
            torso.body = torso.track.advance(seconds)
        if self._posture is Posture.STANDING:
            self._walk_on(seconds)
        elif torso.track:
            torso.take(torso.body)
        self._steps.step(self._base.velocity, seconds, standing=self._posture is Posture.STANDING)
        if not (self._steps.gait or torso.track or self._hull.effort) and torso.body is torso.taken:
            self.duty.end()

    def _walk_on(self, seconds: float) -> None:
        """Sway the body with the gait; after a standstill, return to the default gait."""
        velocity, gait, body = self._base.velocity, self._steps.gait, self._torso.body
        on_a_leash = gait is Gait.TROT_PASSIVE
        if on_a_leash and self._hull.leash and not (self._base.locks.held or self._robot.actions.running(BASE)):
            with suppress(Collided):  # it stands against the obstacle into which it is pulled
                self._base.set_velocity(led(self._hull.leash, self._hull.turned))
        if not (velocity.x or velocity.y or velocity.yaw):
            self._still += 0.0 if on_a_leash else seconds
            self._hull.effort = 0.0
            if self._still >= OWN_GAIT_AFTER:
                self.walk(None)
        elif gait is not None:
            spec, self._still = GAITS[gait], 0.0
            self._steps.count += spec.steps * seconds
            body = swayed(body, spec, self._steps.count, velocity, self._stance)
            self._hull.effort = walking_effort(self._hull, spec, self._steps.lift)
        if body is not self._torso.taken and body != self._torso.taken:
            self._torso.take(body)


def _fit(fit: Fitting) -> SimulatedLegs:
    return SimulatedLegs(fit.body[LegsSection], fit.hull, fit.get(SimulatedBase), fit.robot, fit.tick)


PART = Part(
    name="legs",
    interface=Legs,
    section=LegsSection,
    fit=_fit,
    after=("base",),
    control=SimulatedLegs.control,
    control_after=("gimbal",),
    duty=lambda legs: legs.duty,
)
