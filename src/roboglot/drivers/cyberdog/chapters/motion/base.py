"""Walks by servo frames, twelve a second while a velocity is set. A dog without frames for 0.2 s stands still."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from roboglot.clients.cyberdog import CyberDogClient
from roboglot.clients.cyberdog.chapters.motion import STEP
from roboglot.clients.errors import ClientError
from roboglot.drivers.cyberdog.chapters.mapping.tasks import Skills
from roboglot.drivers.cyberdog.state import ReportedState
from roboglot.drivers.linked_base import LinkedBase, limits_refusal
from roboglot.model.clock import Clock
from roboglot.model.components.motion.base import BaseLimits
from roboglot.model.components.system.link import US, Link
from roboglot.model.errors import Refused
from roboglot.model.geometry import STILL, Twist
from roboglot.wire.cyberdog.chapters.motion.motion import Motion

SPEED, SIDE_SPEED, YAW_SPEED = 0.6, 0.2, 1.3  # m/s, m/s, rad/s of the slow trot
ACCELERATION, YAW_ACCELERATION = 1.0, 3.0  # not reported; only used to plan
FRAME_PERIOD = 0.08  # s


class CyberDogBase(LinkedBase):
    """``velocity`` is dead-reckoned from commands: the dog does not report it."""

    wheels = "a dog has no wheels"

    def __init__(
        self, client: CyberDogClient, clock: Clock, link: Link, reported: ReportedState, skills: Skills
    ) -> None:
        super().__init__(link)
        self._client, self._clock, self._reported, self._skills = client, clock, reported, skills
        self.built = self.limits = BaseLimits(
            twist=Twist(SPEED, SIDE_SPEED, YAW_SPEED),
            linear_acceleration=ACCELERATION,
            angular_acceleration=YAW_ACCELERATION,
        )
        self.motion: int = Motion.TROT_SLOW  # the walk, by its number
        self.lift = STEP  # of the feet, m
        self.clamp: Callable[[Twist], Twist] | None = None  # limits of the current walk; None: ``limits``
        self._changed = asyncio.Event()
        self._sending: asyncio.Task[None] | None = None

    def set_velocity(self, twist: Twist) -> None:
        self.check(twist)
        if self.clamp is not None:
            target = self.clamp(twist)
        else:
            cut = twist.clamped(self.limits.twist)
            target = Twist(cut.x, max(-SIDE_SPEED, min(SIDE_SPEED, cut.y)), cut.yaw)
        if target == self._reported.target:
            return
        self._reported.advance_to(self._clock.time())
        self._reported.target = target
        self._changed.set()
        if self._sending is None:
            self._sending = asyncio.get_running_loop().create_task(self._send(), name="servo frames to a CyberDog")

    @property
    def limits_refusal(self) -> Refused | None:
        return limits_refusal(self._skills.moving)

    @property
    def velocity(self) -> Twist:
        return self._reported.advance_to(self._clock.time()).twist

    async def stop(self) -> None:
        """Stand still; return when the command was sent or has failed."""
        self.set_velocity(STILL)
        if self._sending is not None:
            await asyncio.wait([self._sending])

    async def _send(self) -> None:
        self._link.held_by(US)
        try:
            while self._reported.target != STILL:
                await self._walk()
                await self._client.end_servo(self.motion)  # takes a while; a new velocity may arrive meanwhile
        except ClientError:
            self._reported.target = STILL  # the dog stands by itself when no frames come
        finally:
            self._sending = None
            self._link.held_by("")

    async def _walk(self) -> None:
        while (target := self._reported.target) != STILL:
            self._changed.clear()
            await self._client.servo_frame(self.motion, target.x, target.y, target.yaw, lift=self.lift)
            self._reported.advance_to(self._clock.time())
            self._reported.frame_at = self._clock.time()
            await self._clock.sleep(FRAME_PERIOD / 4)  # upper bound of the rate
            with contextlib.suppress(TimeoutError):
                await self._clock.wait_for(self._changed.wait(), FRAME_PERIOD * 3 / 4)
