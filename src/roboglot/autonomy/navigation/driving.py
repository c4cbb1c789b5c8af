"""Manual driving: velocities that last until replaced, and short moves controlled by odometry. Avoids no obstacles."""

from __future__ import annotations

import asyncio
import math
from dataclasses import field

from msgspec.structs import astuple

from roboglot.autonomy.navigation.base_actions import PERIOD, stand_still, start_on_base
from roboglot.autonomy.navigation.latency_prediction import PosePredictor
from roboglot.autonomy.navigation.speed_profile import APPROACH_GAIN, Ramp, cruise_speed, trapezoid_time
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.displacement import Carried
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.motion.driving import Driving, check_command, check_offset, top_speed
from roboglot.model.components.motion.motion_status import check_on_floor
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Blocked
from roboglot.model.geometry import STILL, Pose, Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.values import dataclass

PATIENCE = 2.0  # s without progress before a move gives up
PROGRESS = 0.005  # m (or rad / TURN_WEIGHT) that count as progress
TURN_WEIGHT = 0.2  # m per rad, to add the remaining distance and turn into one number
CLOSE = 0.004  # m at which braking begins, to stand within 1 cm
CLOSE_YAW = math.radians(0.4)
GOOD = 0.01  # m of error accepted at standstill
GOOD_YAW = math.radians(1.0)
CORRECTIONS_MAX = 3


@dataclass(slots=True)
class _Command:
    """Command that the driving action repeats, and its end (robot time; inf: none)."""

    velocity: Twist | WheelSpeeds
    until: float


@dataclass(slots=True)
class _Move:
    """One move in the odom frame; ``turned``: the turn so far, including whole turns, rad."""

    goal: Pose
    yaw: float  # total turn, not wrapped
    turned: float
    last_yaw: float
    straight: Ramp
    turn: Ramp

    def remaining(self, pose: Pose) -> tuple[float, float]:
        """Return distance (m) and signed turn (rad) left from ``pose``."""
        self.turned += wrap_angle(pose.yaw - self.last_yaw)
        self.last_yaw = pose.yaw
        return pose.distance_to(self.goal), self.yaw - self.turned

    def go_on_from(self, before: _Move, pose: Pose, top: float, top_yaw: float) -> None:
        """Begin with the speeds of ``before``, as far as they lead to the new goal; each axis has its own top speed."""
        self.straight.top, self.turn.top = top, top_yaw
        if pose.point.distance_to(self.goal.point) > 0.0 and pose.point.distance_to(before.goal.point) > 0.0:
            bend = pose.point.bearing_to(self.goal) - pose.point.bearing_to(before.goal)
            self.straight.speed = max(0.0, before.straight.speed * math.cos(bend))
        if self.yaw * (before.yaw - before.turned) > 0.0:
            self.turn.speed = before.turn.speed

    def command(self, pose: Pose, distance: float, angle: float) -> Twist:
        """Return the twist for the next period."""
        yaw_rate = math.copysign(self.turn.step(abs(angle), PERIOD), angle)
        speed = self.straight.step(distance, PERIOD)
        # base_link will have turned further by the middle of the period: aim from there.
        bearing = pose.point.bearing_to(self.goal) - (pose.yaw + yaw_rate * PERIOD / 2.0)
        return Twist(speed * math.cos(bearing), speed * math.sin(bearing), yaw_rate)


@dataclass(slots=True)
class _Moving:
    """The newest short move; ``move``: the move to take over from, until this one has begun."""

    move: _Move | None
    action: Action = field(init=False)
    begun: bool = False
    supervision: asyncio.Task[None] | None = None


class OdometryDriving(Driving):
    """Driving over any Base with Odometry."""

    belief: Belief | None = None  # set if the robot has a map

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._action: Action | None = None  # the newest drive action
        self._command = _Command(STILL, 0.0)
        self._moving: _Moving | None = None

    def drive(self, command: Twist | WheelSpeeds, *, lifetime: float | None = None, source: str = "") -> Action:
        check_command(command, lifetime)
        if any(astuple(command)):
            self._check_free(command)
        wanted = _Command(command, math.inf if lifetime is None else self._robot.clock.time() + lifetime)
        action = self._action
        if action and action.may_go_on(source):
            self._command.velocity, self._command.until = wanted.velocity, wanted.until
            action.goal = command
            if action.status is ActionStatus.EXECUTING and not action.paused:
                self._apply(command)
            return action
        self._command = wanted
        self._action = start_on_base(
            self._robot, "drive", lambda action: self._keep(action, wanted), goal=command, source=source
        )
        return self._action

    def move_by(
        self, offset: Pose, *, speed: float | None = None, yaw_speed: float | None = None, source: str = ""
    ) -> Action:
        limits = self._robot[Base].limits.twist
        top = top_speed(speed, limits.x, "speed")
        top_yaw = top_speed(yaw_speed, limits.yaw, "yaw speed")
        check_offset(offset)
        self._check_free(_way(offset, top))

        before = self._moving
        now = self._robot[Base].velocity
        back = now.x * offset.x + now.y * offset.y < 0.0  # wheels that are reversed at once slip
        if before is None or back or not before.action.may_go_on(source) or before.action.paused:
            before = None
        moving = _Moving(before.move if before else None)

        async def run(action: Action) -> None:
            moving.begun = True
            await self.move(action, offset, top, top_yaw, moving)

        moving.action = start_on_base(self._robot, "move by", run, goal=offset, source=source)
        if before is not None:  # it was cancelled just now and stops nothing
            before.action.hands_over = True
            loop = asyncio.get_running_loop()
            moving.supervision = loop.create_task(self._supervise(moving), name="taking over a move")
        self._moving = moving
        return moving.action

    async def _supervise(self, moving: _Moving) -> None:
        """Brake for a move that was cancelled before it could take over another's motion."""
        await moving.action.done()
        if not moving.begun:
            self._brake()

    def _check_free(self, command: Twist | WheelSpeeds) -> None:
        """Raise the base's refusal at once: manual driving does not wait for the end of an action."""
        if (refusal := self._robot[Base].refusal) is not None:
            raise type(refusal)(*refusal.args)
        self._robot[Base].check_free(command)
        if (hindrance := self._robot[Base].hindrance(command)) is not None:
            raise hindrance

    def _apply(self, velocity: Twist | WheelSpeeds) -> None:
        if isinstance(velocity, Twist):
            self._robot[Base].set_velocity(velocity)
        else:
            self._robot[Base].set_wheel_speeds(velocity)

    def _brake(self) -> None:
        self._robot[Base].set_velocity(STILL)

    async def _keep(self, action: Action, command: _Command) -> None:
        """Repeat ``command``, which later calls of ``drive`` change, until its end. Raises Blocked."""
        clock = self._robot.clock

        def step() -> float | None:
            left = command.until - clock.time()
            if left <= 1e-9 or action.paused:
                return None
            self._apply(command.velocity)
            if (hindrance := self._robot[Base].hindrance(command.velocity)) is not None:
                raise hindrance
            return min(PERIOD, left)

        try:
            while (left := command.until - clock.time()) > 1e-9:
                if action.paused:
                    await self._hold_at_most(action, left)
                else:
                    await clock.keep_calling(step)
        finally:
            if self._command is command:
                self._action = None  # the robot brakes from now on: later commands start a new one

    async def _hold_at_most(self, action: Action, seconds: float) -> None:
        """Pause for at most ``seconds``, the rest of the command's lifetime."""
        if math.isinf(seconds):
            await action.hold(self._brake)
            return
        try:
            await self._robot.clock.wait_for(action.hold(self._brake), seconds)
        except TimeoutError:
            return

    async def move(
        self, action: Action, offset: Pose, top: float, top_yaw: float, moving: _Moving | None = None
    ) -> None:
        """Make a short move within an action that holds the base. Raises Blocked, NotLocalized.

        ``top``: m/s, ``top_yaw``: rad/s. ``moving``: holds the move to take over from, with its speed; this move
        replaces it there.
        """
        base, odometry = self._robot[Base], self._robot[Odometry]
        start = odometry.reading.pose
        limits = base.limits
        distance, angle = math.hypot(offset.x, offset.y), abs(offset.yaw)
        duration = max(
            trapezoid_time(distance, top, limits.linear_acceleration),
            trapezoid_time(angle, top_yaw, limits.angular_acceleration),
        )
        move = _Move(
            start.compose(offset),
            offset.yaw,
            0.0,
            start.yaw,
            Ramp(cruise_speed(distance, duration, limits.linear_acceleration), limits.linear_acceleration),
            Ramp(cruise_speed(angle, duration, limits.angular_acceleration), limits.angular_acceleration),
        )
        if moving is not None:
            if moving.move is not None:
                move.go_on_from(moving.move, start, top, top_yaw)
            moving.move = move
        with Carried(self._robot, self.belief) as carried:
            for _ in range(CORRECTIONS_MAX):
                await self._approach(action, move)
                await stand_still(self._robot)
                distance, angle = move.remaining(odometry.reading.pose)
                if distance <= GOOD and abs(angle) <= GOOD_YAW:
                    break
            else:
                raise Blocked(f"cannot settle: {distance:.3f} m and {math.degrees(angle):.1f} degrees off")
            await carried.check()

    async def _approach(self, action: Action, move: _Move) -> None:
        """Drive until close enough to brake. Raises Blocked without progress, Refused off the floor."""
        base, odometry, clock = self._robot[Base], self._robot[Odometry], self._robot.clock
        predictor = PosePredictor(base, clock)
        # A correction after overshooting must be able to move, however slow the plan was.
        move.straight.top, move.turn.top = max(move.straight.top, 0.05), max(move.turn.top, 0.1)
        if base.delay > 0.0:  # late commands must not be hurried
            move.straight.gain = move.turn.gain = min(APPROACH_GAIN, 1.0 / base.delay)
        best, best_at = math.inf, clock.time()
        while True:
            if await action.hold(self._brake):
                best_at = clock.time()
                move.straight.speed = move.turn.speed = 0.0
            check_on_floor(self._robot)
            pose = predictor.ahead(odometry.reading.pose)
            distance, angle = move.remaining(pose)
            if distance <= CLOSE and abs(angle) <= CLOSE_YAW:
                return
            left = distance + TURN_WEIGHT * abs(angle)
            if left < best - PROGRESS:
                best, best_at = left, clock.time()
            elif clock.time() - best_at > PATIENCE:
                raise Blocked(
                    f"no progress for {PATIENCE:g} s, {distance:.2f} m and {math.degrees(angle):.0f} degrees left"
                )
            command = move.command(pose, distance, angle)
            base.set_velocity(command)
            predictor.sent(command)
            await clock.sleep(PERIOD)


def _way(offset: Pose, speed: float) -> Twist:
    """Return the velocity at the start of a move; STILL if it only turns."""
    way = math.hypot(offset.x, offset.y)
    return Twist(speed * offset.x / way, speed * offset.y / way, 0.0) if way > 0.0 else STILL
