"""The gimbal of an EP. Motions start without awaiting the reply, since a waiting robot answers nothing else; pushes
report the angles.
"""

from __future__ import annotations

import math

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster import motion
from roboglot.drivers.robomaster.state import ReportedState
from roboglot.drivers.setting import Setting
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.motion.gimbal import GIMBAL, FollowMode, Gimbal, GimbalAngles, GimbalFrame, GimbalLimits
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import bounded, wrap_angle
from roboglot.model.robot import Robot

GOOD = math.radians(1.0)
SPEED_MAX = math.radians(540)
LIMITS = GimbalLimits(
    lowest=GimbalAngles(-math.radians(35), -math.radians(250)),
    highest=GimbalAngles(math.radians(20), math.radians(250)),
    speed=SPEED_MAX,
)


class RoboMasterGimbal(Gimbal):
    """Mode and suspension are this client's settings; the robot does not report changes by others."""

    limits = LIMITS

    def __init__(self, robot: Robot, client: RoboMasterClient, supervisor: Supervisor, reported: ReportedState) -> None:
        self._robot, self._client, self._supervisor, self._reported = robot, client, supervisor, reported
        self._motions = motion.Motions(robot, supervisor)
        self._mode, self._suspended = Setting(supervisor, FollowMode.CHASSIS_LEAD), Setting(supervisor, False)

    async def probe(self) -> None:
        """Poll attitude and mode. Raises RefusedByRobot without a gimbal; only the attitude shows that."""
        await self._client.gimbal.get_attitude()
        words = await self._client.robot.get_mode()
        self._mode.read(next((mode for mode in FollowMode if mode == words), FollowMode.CHASSIS_LEAD))

    @property
    def angles(self) -> GimbalAngles:
        gimbal = self._reported.gimbal
        return GimbalAngles(gimbal.pitch - self._reported.imu.orientation.pitch, gimbal.yaw)

    @property
    def attitude(self) -> GimbalAngles:
        gimbal = self._reported.gimbal
        return GimbalAngles(gimbal.pitch, gimbal.yaw + self._reported.imu.orientation.yaw)

    @property
    def mode(self) -> FollowMode:
        return self._mode.value

    def set_mode(self, mode: FollowMode) -> None:
        self._mode.send("setting the mode", mode, lambda: self._client.robot.mode(mode.value))

    @property
    def suspended(self) -> bool:
        return self._suspended.value

    def suspend(self) -> None:
        for action in self._robot.actions.running(GIMBAL):
            action.cancel("the gimbal is suspended")
        self._suspend(True)

    def resume(self) -> None:
        self._suspend(False)

    def _suspend(self, on: bool) -> None:
        command = self._client.gimbal.suspend if on else self._client.gimbal.resume
        self._suspended.send("suspending or waking the gimbal", on, command)

    def set_speed(self, pitch: float, yaw: float, *, source: str = "") -> Action:
        if not (math.isfinite(pitch) and math.isfinite(yaw)):
            raise InvalidGoal("a speed must be finite")
        top = self.limits.speed
        pitch, yaw = bounded(pitch, top), bounded(yaw, top)

        async def turn() -> None:
            await self._client.gimbal.speed(-math.degrees(pitch), -math.degrees(yaw))
            while pitch or yaw:
                await self._robot.clock.sleep(motion.PERIOD)
                self._supervisor.link.require()

        return self._start("gimbal speed", turn, (pitch, yaw), source)

    def move_to(
        self,
        *,
        pitch: float | None = None,
        yaw: float | None = None,
        frame: GimbalFrame = GimbalFrame.BODY,
        pitch_speed: float | None = None,
        yaw_speed: float | None = None,
        source: str = "",
    ) -> Action:
        low, high = self.limits.lowest, self.limits.highest
        if frame is GimbalFrame.BODY and not (
            low.pitch <= (pitch or 0.0) <= high.pitch and low.yaw <= (yaw or 0.0) <= high.yaw
        ):
            raise InvalidGoal(f"the gimbal does not reach {pitch}, {yaw}")
        body = self._reported.imu.orientation
        goal_pitch = None if pitch is None else pitch + (body.pitch if frame is GimbalFrame.BODY else 0.0)
        goal_yaw = None if yaw is None else self._joint(yaw - body.yaw) if frame is GimbalFrame.WORLD else yaw

        async def turn() -> None:
            goal = self._far_yaw(goal_yaw)
            await self._client.gimbal.moveto(
                _degrees(goal_pitch), _degrees(goal_yaw), vp=_speed(pitch_speed), vy=_speed(yaw_speed), wait=False
            )
            await self._arrive(goal_pitch, goal)

        return self._start("gimbal move to", turn, (pitch, yaw), source)

    def move_by(
        self,
        *,
        pitch: float = 0.0,
        yaw: float = 0.0,
        pitch_speed: float | None = None,
        yaw_speed: float | None = None,
        source: str = "",
    ) -> Action:
        async def turn() -> None:
            now = self._reported.gimbal
            goal = self._far_yaw(now.yaw + yaw if yaw else None)
            await self._client.gimbal.move(
                _degrees(pitch), _degrees(yaw), vp=_speed(pitch_speed), vy=_speed(yaw_speed), wait=False
            )
            await self._arrive(now.pitch + pitch if pitch else None, goal)

        return self._start("gimbal move by", turn, (pitch, yaw), source)

    def recenter(self, *, source: str = "") -> Action:
        async def turn() -> None:
            goal = self._far_yaw(0.0)
            await self._client.gimbal.recenter(wait=False)
            await self._arrive(self._reported.imu.orientation.pitch, goal)

        return self._start("gimbal recenter", turn, None, source)

    def _start(self, name: str, turn: motion.Run, goal: object, source: str) -> Action:
        if self.suspended:
            raise Refused("the gimbal is suspended")
        return self._motions.start(name, turn, self._halt, resource=GIMBAL, goal=goal, source=source)

    async def _halt(self) -> None:
        await self._client.gimbal.speed(0.0, 0.0)

    def _joint(self, yaw: float) -> float:
        """Return the joint angle within the travel that gives ``yaw`` to the body and is nearest to the current one."""
        now = self._reported.gimbal.yaw
        near = now + wrap_angle(yaw - now)
        if self.limits.lowest.yaw <= near <= self.limits.highest.yaw:
            return near
        return near - math.copysign(math.tau, near)

    def _far_yaw(self, joint: float | None) -> float | None:
        """Return the target of ``_arrive``: the joint angle, or the world heading if the chassis follows the gimbal."""
        follows = joint is not None and self.mode is FollowMode.GIMBAL_LEAD
        return joint + self._reported.imu.orientation.yaw if joint is not None and follows else joint

    async def _arrive(self, pitch: float | None, yaw: float | None) -> None:
        """Wait until pushes report the target. Raises Blocked at a limit or in a mode without yaw."""
        follows = self.mode is FollowMode.GIMBAL_LEAD

        async def left() -> float:
            now = self._reported.gimbal
            if yaw is None:
                turn = 0.0
            elif follows:
                turn = abs(wrap_angle(yaw - self.attitude.yaw))
            else:
                turn = abs(yaw - now.yaw)
            return max(0.0 if pitch is None else abs(pitch - now.pitch), turn)

        await self._motions.arrive(left, GOOD, "the gimbal")


def _degrees(angle: float | None) -> float | None:
    """Return degrees with the EP's signs: pitch up and yaw right are positive."""
    return None if angle is None else -math.degrees(angle)


def _speed(speed: float | None) -> float | None:
    return None if speed is None else round(math.degrees(speed), 2)
