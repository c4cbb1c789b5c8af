"""Manual driving by pulses: velocities, and short moves controlled by the robot's odometry.

Autonomy's driving does not fit: it needs a base that steers and drives at the same time.
"""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress

from roboglot.drivers.slamware.chapters.motion.base import SlamwareBase
from roboglot.drivers.slamware.state import ReportedState
from roboglot.drivers.slamware.vocabulary import robot_errors
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.driving import BASE, Driving, check_command, check_offset, top_speed
from roboglot.model.components.system.link import Link
from roboglot.model.errors import Blocked, Busy, Refused
from roboglot.model.geometry import STILL, Pose, Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.values import dataclass

PERIOD = 0.05  # s between two looks at odometry
GOOD, GOOD_YAW = 0.005, math.radians(0.4)  # m, rad: tolerance of the goal; the latency of the link adds to it
LEAD = 0.09  # s that braking takes
SLOW, SLOW_YAW = 0.03, 0.06  # m/s, rad/s: speeds of the last centimetres
GAIN, GAIN_YAW = 1.2, 1.8  # 1/s: speed per remaining way
PATIENCE = 3.0  # s without progress before giving up
SETTLED = 0.3  # s of standstill before the result counts, as odometry is delayed
TRIES_MAX = 4
REST_SPEED, REST_YAW_RATE, REST_MAX = 0.01, 0.03, 3.0


@dataclass(slots=True)
class _Command:
    velocity: Twist
    until: float


class SlamwareDriving(Driving):
    """Holds BASE while it drives. A robot that cannot go sideways turns, drives and turns."""

    def __init__(self, robot: Robot, base: SlamwareBase, link: Link, reported: ReportedState) -> None:
        self._robot, self._base, self._link, self._reported = robot, base, link, reported
        self._action: Action | None = None
        self._command = _Command(STILL, 0.0)

    def drive(self, command: Twist | WheelSpeeds, *, lifetime: float | None = None, source: str = "") -> Action:
        check_command(command, lifetime)
        if isinstance(command, WheelSpeeds):
            if command != WheelSpeeds():
                raise Refused("the wheels of a Slamware robot cannot be turned one by one")
            command = STILL
        self._link.require()
        until = math.inf if lifetime is None else self._robot.clock.time() + lifetime
        action = self._action
        if action and action.may_go_on(source):
            self._command.velocity, self._command.until = command, until
            action.goal = command
            if not action.paused:
                self._base.set_velocity(command)
            return action
        wanted = self._command = _Command(command, until)

        async def keep(action: Action) -> None:
            try:
                while (left := wanted.until - self._robot.clock.time()) > 1e-9:
                    if action.paused:
                        await self._hold_at_most(action, left)
                        continue
                    self._base.set_velocity(wanted.velocity)
                    await self._robot.clock.sleep(min(PERIOD, left))
                    self._check()
            finally:
                if self._command is wanted:
                    self._action = None  # it brakes: later commands start a new one

        self._action = self._start("drive", keep, goal=command, source=source)
        return self._action

    def move_by(
        self, offset: Pose, *, speed: float | None = None, yaw_speed: float | None = None, source: str = ""
    ) -> Action:
        limits = self._base.limits.twist
        top, top_yaw = top_speed(speed, limits.x, "speed"), top_speed(yaw_speed, limits.yaw, "yaw speed")
        check_offset(offset)
        self._link.require()

        async def run(action: Action) -> None:
            start = self._reported.odometry.pose
            goal = start.compose(offset)
            first = 0.0
            if abs(offset.y) > GOOD:
                bearing = math.atan2(offset.y, offset.x)
                first = wrap_angle(bearing + math.pi) if abs(bearing) > math.pi / 2 else bearing
                await self._turn(action, first, top_yaw)
            if math.hypot(offset.x, offset.y) > GOOD:
                await self._straight(action, goal, top)
            await self._turn(action, offset.yaw - first, top_yaw)

        return self._start("move by", run, goal=offset, source=source)

    def _start(self, name: str, run: Callable[[Action], Awaitable[None]], *, goal: object, source: str) -> Action:
        async def braked(action: Action) -> None:
            async with self._braking():
                with robot_errors():
                    await run(action)

        return self._robot.actions.start(name, braked, resources={BASE}, goal=goal, source=source, pausable=True)

    @asynccontextmanager
    async def _braking(self) -> AsyncIterator[None]:
        try:
            yield
        finally:
            await self._rest()

    async def _rest(self) -> None:
        """Brake and wait until the robot reports standstill or goes silent."""
        await self._base.stop()
        if isinstance(self._base.error, Busy):  # another client is moving the robot
            return
        clock = self._robot.clock
        deadline, settled = clock.time() + REST_MAX, clock.time() + SETTLED
        while clock.time() < deadline and not self._down:
            twist = self._reported.twist
            if clock.time() >= settled and twist.speed < REST_SPEED and abs(twist.yaw) < REST_YAW_RATE:
                return
            await clock.sleep(PERIOD)

    @property
    def _down(self) -> bool:
        return self._link.age("odometry") > REST_MAX / 2

    @property
    def _lead(self) -> float:
        """Seconds between an odometry reading and the standstill that it triggers: one round trip and the braking."""
        return LEAD + self._reported.latency

    def _calm(self, gain: float) -> float:
        """Return the gain, reduced so that it does not overshoot on a slow link."""
        return min(gain, 0.4 / (0.1 + self._reported.latency))

    def _check(self) -> None:
        """Raise the error of the last pulse, if it failed."""
        self._link.require()
        if self._base.error is not None:
            raise self._base.error

    async def _straight(self, action: Action, goal: Pose, top: float) -> None:
        """Drive ahead or back until beside ``goal`` (odom frame)."""
        for _ in range(TRIES_MAX):
            best, best_at = math.inf, self._robot.clock.time()
            while True:
                left = goal.relative_to(self._reported.odometry.pose).x
                if abs(left) - abs(self._reported.twist.x) * self._lead <= GOOD / 4:
                    break
                if abs(left) < best - 0.005:
                    best, best_at = abs(left), self._robot.clock.time()
                self._give_up_after(best_at, f"{abs(left):.2f} m left")
                speed = min(max(self._calm(GAIN) * abs(left), SLOW), top)
                await self._hold(action, Twist(math.copysign(speed, left)))
            await self._rest()
            if abs(goal.relative_to(self._reported.odometry.pose).x) <= GOOD + SLOW * self._reported.latency:
                return
        raise Blocked(f"cannot settle: {abs(left):.3f} m off")

    async def _turn(self, action: Action, angle: float, top: float) -> None:
        """Turn by ``angle`` (rad, signed, may exceed a full turn)."""
        turned, last = 0.0, self._reported.odometry.pose.yaw
        for _ in range(TRIES_MAX):
            best, best_at = math.inf, self._robot.clock.time()
            while True:
                yaw = self._reported.odometry.pose.yaw
                turned, last = turned + wrap_angle(yaw - last), yaw
                left = angle - turned
                if abs(left) - abs(self._reported.twist.yaw) * self._lead <= GOOD_YAW / 4:
                    break
                if abs(left) < best - 0.01:
                    best, best_at = abs(left), self._robot.clock.time()
                self._give_up_after(best_at, f"{math.degrees(abs(left)):.0f} degrees left")
                rate = min(max(self._calm(GAIN_YAW) * abs(left), SLOW_YAW), top)
                await self._hold(action, Twist(yaw=math.copysign(rate, left)))
            if self._reported.twist == STILL and abs(left) <= GOOD_YAW:
                return
            await self._rest()
            yaw = self._reported.odometry.pose.yaw
            turned, last = turned + wrap_angle(yaw - last), yaw
            if abs(angle - turned) <= GOOD_YAW + SLOW_YAW * self._reported.latency:
                return
        raise Blocked(f"cannot settle: {math.degrees(angle - turned):.1f} degrees off")

    async def _hold_at_most(self, action: Action, seconds: float) -> None:
        """Pause for at most ``seconds``, the rest of the command's lifetime."""
        with suppress(TimeoutError):
            await self._robot.clock.wait_for(action.hold(lambda: self._base.set_velocity(STILL)), seconds)

    async def _hold(self, action: Action, twist: Twist) -> None:
        if not await action.hold(lambda: self._base.set_velocity(STILL)):
            self._base.set_velocity(twist)
            await self._robot.clock.sleep(PERIOD)
            self._check()

    def _give_up_after(self, since: float, what: str) -> None:
        if self._robot.clock.time() - since > PATIENCE:
            raise Blocked(f"no progress for {PATIENCE:g} s, {what}")
