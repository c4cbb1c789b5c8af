"""Velocity control for a robot with remote control only: pulses of MoveBy that end by themselves.

A pulse lasts 0.4 s and is renewed while the velocity is set, so the robot stops within half a second if this program,
its machine or the network is gone. A pulse either drives or turns: an arc becomes short turns between short
straights. The robot sets the speed of a pulse; its speed limit, restored afterwards, makes it slower.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import Final

from roboglot.clients.errors import ClientError
from roboglot.clients.slamware import RunningAction, SlamwareClient, SlamwareRefused
from roboglot.drivers.linked_base import LinkedBase, limits_refusal
from roboglot.drivers.slamware.chapters.motion.actions import ActionRunner
from roboglot.drivers.slamware.chapters.motion.arcs import ArcSplitter
from roboglot.drivers.slamware.chapters.motion.speed_limit_restore import PARAMETER, SpeedLimitRestore
from roboglot.drivers.slamware.state import ReportedState
from roboglot.model.components.motion.base import BaseLimits
from roboglot.model.components.system.link import Link
from roboglot.model.errors import Busy, Refused
from roboglot.model.geometry import STILL, Twist
from roboglot.model.robot import Robot
from roboglot.wire.slamware.chapters.motion import Direction, MoveByOptions
from roboglot.wire.slamware.chapters.system.devices import Parameter

PULSE = 0.4  # s for which the robot continues without a new pulse
RENEWAL = 0.1  # s between two pulses
SPEED, YAW_SPEED = 0.5, 1.0  # m/s, rad/s: assumed before the robot reports its limits
ACCELERATION, YAW_ACCELERATION = 0.5, 1.5  # m/s2, rad/s2: not reported; only used to plan
YAW_PARAMETER: Final = "base.max_angular_speed"
SPEED_MIN = 0.02  # m/s; robots refuse a lower limit
CATCH_UP = 2.5  # for the speeds of an arc, each of which gets less than half of the time
SPEED_STEP = 0.02  # m/s: a smaller change of speed is not sent


class SlamwareBase(LinkedBase):
    """``velocity`` is reported by the robot; ``wheel_speeds`` are not, and stay 0."""

    def __init__(
        self, robot: Robot, client: SlamwareClient, link: Link, reported: ReportedState, runner: ActionRunner
    ) -> None:
        super().__init__(link)
        self._client, self._clock, self._reported = client, robot.clock, reported
        self._runner, self._limit_restore = runner, SpeedLimitRestore(robot, client, link)
        self.built = self.limits = _limits(SPEED, YAW_SPEED)
        self._target = STILL
        self._changed = asyncio.Event()
        self._still = asyncio.Event()
        self._still.set()
        self._pulsing: asyncio.Task[None] | None = None
        self._last: RunningAction | None = None
        self._limit: float | None = None  # our limit; None: the robot's own
        self._turns: ArcSplitter | None = None  # of an arc
        self.error: Exception | None = None  # why the last pulse could not be sent

    def set_velocity(self, twist: Twist) -> None:
        self.check(twist)
        self._target = Twist(twist.x, 0.0, twist.yaw).clamped(self.limits.twist)
        self._changed.set()
        if self._target != STILL and self._pulsing is None:
            self.error = None
            self._still.clear()
            self._pulsing = asyncio.get_running_loop().create_task(self._pulse(), name="pulses to a Slamware robot")

    @property
    def velocity(self) -> Twist:
        return self._reported.twist

    @property
    def limits_refusal(self) -> Refused | None:
        return limits_refusal(self._runner.moving)

    @property
    def share(self) -> float:
        """Share of the robot's own top speed that clients allow."""
        return min(1.0, self.limits.twist.x / max(self.built.twist.x, SPEED_MIN))

    async def probe(self) -> None:
        """Poll the limits of the robot."""
        speed, yaw_speed = SPEED, YAW_SPEED
        self._limit_restore.recall()
        await self._limit_restore.restore()
        with contextlib.suppress(SlamwareRefused, ValueError):
            speed = float(await self._client.get_system_parameter(PARAMETER))
            yaw_speed = float(await self._client.get_system_parameter(YAW_PARAMETER))
        if (found := _limits(speed, yaw_speed)) != self.built:  # a client's limit stays over a break of the link
            self.built = self.limits = found

    async def stop(self) -> None:
        """Brake; return when the command was sent or has failed."""
        self.set_velocity(STILL)
        await self._still.wait()

    async def _pulse(self) -> None:
        try:
            while self._target != STILL:
                self._changed.clear()
                await self._send(self._target)
                with contextlib.suppress(TimeoutError):
                    await self._clock.wait_for(self._changed.wait(), RENEWAL)
                if await self._runner.taken_over():  # a further pulse would take control back
                    self.error, self._target = Busy("another client of the robot took over"), STILL
        except ClientError as error:
            self.error, self._target = error, STILL
        finally:
            with contextlib.suppress(ClientError):
                await self._halt()
            self._pulsing = None
            self._still.set()

    async def _send(self, target: Twist) -> None:
        """Send one pulse towards ``target``; an arc alternates between driving and turning."""
        turn, share = bool(target.yaw), 1.0
        if target.x and target.yaw:
            now, pose = self._clock.time(), self._reported.odometry.pose
            if self._turns is None or self._turns.twist != target:
                self._turns = ArcSplitter(target, now, pose)
            turn, share = self._turns.turning(now, pose), CATCH_UP
        milliseconds = round(PULSE * 1000)
        if turn:
            top = self.limits.twist.yaw
            options = MoveByOptions(theta=max(-top, min(top, target.yaw * share)), duration=milliseconds)
        else:
            await self._limit_speed(min(abs(target.x) * share, self.limits.twist.x))
            forward = target.x > 0
            options = MoveByOptions(Direction.FORWARD if forward else Direction.BACKWARD, duration=milliseconds)
        self._last = await self._runner.begin("MoveByAction", options)

    async def _limit_speed(self, speed: float) -> None:
        """Send the limit if it differs enough; the robot's own limit is restored exactly.

        Raises SlamwareRefused for a refused one: without it the robot would drive faster than it should.
        """
        speed, own = max(speed, SPEED_MIN), self.built.twist.x
        limit = own if self._limit is None else self._limit
        if abs(speed - limit) < SPEED_STEP and (speed == own) == (limit == own):
            return
        await self._limit_restore.remember(own)
        try:
            await self._client.set_system_parameter(Parameter(PARAMETER, f"{speed:.3f}"))
        except SlamwareRefused:
            if speed < own:
                raise
        self._limit = speed

    async def _halt(self) -> None:
        last, self._last, self._turns, self._limit = self._last, None, None, None
        if last is not None:
            await last.cancel()
        await self._limit_restore.restore()


def _limits(speed: float, yaw_speed: float) -> BaseLimits:
    return BaseLimits(
        twist=Twist(speed, 0.0, yaw_speed),
        linear_acceleration=ACCELERATION,
        angular_acceleration=YAW_ACCELERATION,
        holonomic=False,
    )
