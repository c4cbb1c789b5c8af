"""Mecanum wheels: the latest velocity is sent repeatedly as a short ``chassis move`` that ends by itself.

An EP keeps a ``chassis speed`` while the connection lasts, even if the client falls silent. A move that is renewed
before it ends is its only bounded motion. Unless ``bounded``, velocities are sent by ``chassis speed``.
One command is in flight at a time; a later one replaces the pending one, so nothing queues behind a slow link.
"""

from __future__ import annotations

import asyncio
import contextlib
import math

from roboglot.clients.errors import ClientError
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.linked_base import LinkedBase
from roboglot.drivers.reported import ReportedImu
from roboglot.drivers.robomaster.state import ReportedState
from roboglot.drivers.robomaster.vocabulary import speed_words, wheel_words
from roboglot.model.clock import Clock
from roboglot.model.components.motion.base import BaseLimits, WheelSpeeds
from roboglot.model.components.motion.motion_status import MotionFlags, MotionStatus
from roboglot.model.components.system.link import US, Link
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import STILL, Twist

SPEED, YAW_SPEED = 3.5, math.radians(600)  # the manual's limits of a move
ACCELERATION, YAW_ACCELERATION = 2.0, 6.0  # m/s2, rad/s2: not in the manual; only used to plan
REMINDER = 0.06  # s until an unchanged velocity is sent again
SPARE = 0.18  # s added to a move's duration; it slows down in the last sixth of a second
SLOWING = 1.6  # a robot brakes in time to stop at the end; it decelerates at least this many times ACCELERATION / 2
SLOWEST, SLOWEST_TURN = 0.1, math.radians(10)  # m/s, rad/s: moves of real builds are no slower
LATENCY_MIN = 0.02  # s of a round trip, below which pushes take longer than answers
DELAYS = 1.5  # round trips until a command's result is known: it waits for the previous one, then travels both ways
WHEEL_RPM = 1000


class RoboMasterBase(LinkedBase):
    """``velocity`` and ``wheel_speeds`` are measured by the robot."""

    def __init__(
        self, client: RoboMasterClient, clock: Clock, link: Link, reported: ReportedState, *, bounded: bool = True
    ) -> None:
        super().__init__(link)
        self._bounded = bounded
        self._client, self._clock, self._reported = client, clock, reported
        self.built = self.limits = BaseLimits(
            twist=Twist(SPEED, SPEED, YAW_SPEED),
            linear_acceleration=ACCELERATION,
            angular_acceleration=YAW_ACCELERATION,
        )
        self._target: Twist | WheelSpeeds = STILL
        self._changed = asyncio.Event()
        self._sending: asyncio.Task[None] | None = None

    def set_velocity(self, twist: Twist) -> None:
        self.check(twist)
        self._aim(twist.clamped(self.limits.twist), still=twist == STILL)

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        if any(not abs(word) <= WHEEL_RPM for word in wheel_words(speeds, self._client.as_robots)):
            raise InvalidGoal(f"a wheel turns at up to {WHEEL_RPM} rpm")
        self._aim(speeds, still=speeds == WheelSpeeds())

    @property
    def delay(self) -> float:
        return DELAYS * self._reported.latency if self._reported.latency > LATENCY_MIN else 0.0

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        return self._reported.wheels

    @property
    def velocity(self) -> Twist:
        return self._reported.twist

    async def stop(self) -> None:
        """Brake; return when the command was sent or has failed."""
        self.set_velocity(STILL)
        if self._sending is not None:
            await asyncio.wait([self._sending])

    def _aim(self, target: Twist | WheelSpeeds, *, still: bool) -> None:
        if not still:
            self._link.require()
        if target == self._target:
            return
        self._target = target
        self._changed.set()
        if self._sending is None:
            self._sending = asyncio.get_running_loop().create_task(self._send(), name="velocities to a RoboMaster")

    async def _send(self) -> None:
        """Send velocities until the robot was commanded to stand still."""
        self._link.held_by(US)
        try:
            while True:
                self._changed.clear()
                target = self._target
                await self._command(target)
                if self._changed.is_set():
                    continue
                if target in (STILL, WheelSpeeds()):
                    return
                with contextlib.suppress(TimeoutError):
                    await self._clock.wait_for(self._changed.wait(), REMINDER)
        except ClientError:
            self._target = STILL  # the robot stops by itself without its client
        finally:
            self._sending = None
            self._link.held_by("")

    async def _command(self, target: Twist | WheelSpeeds) -> None:
        if isinstance(target, Twist):
            if self._bounded and target != STILL:
                await self._push(target)
            else:
                await self._client.chassis.speed(*speed_words(target))
        else:
            await self._client.chassis.wheel(*wheel_words(target, self._client.as_robots))

    async def _push(self, twist: Twist) -> None:
        """Send a move that covers this velocity until the next renewal, with a margin."""
        slowest, slowest_turn = (SLOWEST, SLOWEST_TURN) if self._client.as_robots else (0.0, 0.0)
        speed, turn = max(twist.speed, slowest), max(abs(twist.yaw), slowest_turn)
        period = max(REMINDER, self._reported.latency)
        way = _reach(twist.speed, slowest, ACCELERATION, period)
        angle = _reach(abs(twist.yaw), slowest_turn, YAW_ACCELERATION, period)
        bend = twist.yaw * period / 2  # half of the turn until then: the route goes straight, the robot in an arc
        ahead = Twist(
            twist.x * math.cos(bend) - twist.y * math.sin(bend), twist.x * math.sin(bend) + twist.y * math.cos(bend)
        )
        x, y, z = speed_words(Twist(ahead.x * way, ahead.y * way, twist.yaw * angle))
        await self._client.chassis.move(
            x, y, z, vxy=round(min(speed, SPEED), 4) or None, vz=round(math.degrees(min(turn, YAW_SPEED)), 3) or None
        )


class RoboMasterImu(ReportedImu):
    """Attitude of the chassis."""

    def __init__(self, client: RoboMasterClient, reported: ReportedState) -> None:
        super().__init__(lambda: reported.imu)
        self._client = client

    async def probe(self) -> None:
        """Ask for the attitude. Raises ClientError."""
        await self._client.chassis.get_attitude()


class RoboMasterMotionStatus(MotionStatus):
    """Flags of ``chassis push status``."""

    def __init__(self, client: RoboMasterClient, reported: ReportedState) -> None:
        self._client, self._reported = client, reported

    async def probe(self) -> None:
        """Subscribe to the pushes. Raises ClientError."""
        await self._client.chassis.push(status=True)

    @property
    def flags(self) -> MotionFlags:
        return self._reported.flags


def _reach(speed: float, slowest: float, acceleration: float, period: float) -> float:
    """Return the seconds of motion in one move: enough not to slow down before its renewal after ``period`` s."""
    if speed < slowest:
        return period  # wait at the end
    return period + max(SPARE, speed / (SLOWING * acceleration))
