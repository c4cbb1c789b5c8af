"""The arm of an EP. The manual measures in cm from the position at power-on, real robots in mm from the shoulder."""

from __future__ import annotations

import math

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster import motion
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.motion.arm import ARM, Arm, ArmPosition, ArmReach
from roboglot.model.errors import InvalidGoal
from roboglot.model.robot import Robot

HOME = ArmPosition(0.091, 0.041)
REACH = ArmReach(ArmPosition(0.07, -0.06), ArmPosition(0.22, 0.15), 0.24)
GOOD = 0.002  # m


class RoboMasterArm(Arm):
    """``reach`` and ``home`` are a stock EP's; the robot refuses positions out of reach."""

    reach, home = REACH, HOME

    def __init__(self, robot: Robot, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._robot, self._client, self._supervisor = robot, client, supervisor
        self._motions = motion.Motions(robot, supervisor)
        self._position = HOME

    async def refresh(self) -> None:
        """Poll the position."""
        reply = await self._client.robotic_arm.get_position()
        unit, origin = self._scale
        self._position = ArmPosition(origin.x + reply.x * unit, origin.z + reply.y * unit)

    @property
    def position(self) -> ArmPosition:
        return self._position

    def move_to(self, position: ArmPosition, *, source: str = "") -> Action:
        low, high = self.reach.lowest, self.reach.highest
        inside = low.x - 1e-9 <= position.x <= high.x + 1e-9 and low.z - 1e-9 <= position.z <= high.z + 1e-9
        if not inside or not math.hypot(position.x, position.z) <= self.reach.radius + 1e-9:
            raise InvalidGoal(f"an EP's arm does not reach ({position.x:.4g}, {position.z:.4g})")
        unit, origin = self._scale
        x, y = (position.x - origin.x) / unit, (position.z - origin.z) / unit

        async def run() -> None:
            await self._client.robotic_arm.moveto(round(x, 3), round(y, 3))
            await self._arrive(position)

        return self._start("move arm", run, position, source)

    def move_by(self, offset: ArmPosition, *, source: str = "") -> Action:
        now = self._position
        return self.move_to(ArmPosition(now.x + offset.x, now.z + offset.z), source=source)

    def recenter(self, *, source: str = "") -> Action:
        async def run() -> None:
            await self._client.robotic_arm.recenter()
            await self._arrive(self.home)

        return self._start("recenter arm", run, self.home, source)

    def stop(self) -> None:
        for action in self._robot.actions.running(ARM):
            action.cancel("the arm was stopped")
        self._supervisor.send("stopping the arm", self._client.robotic_arm.stop(), always=True)

    @property
    def _scale(self) -> tuple[float, ArmPosition]:
        """Return metres per unit, and the origin."""
        return (0.001, ArmPosition()) if self._client.as_robots else (0.01, self.home)

    def _start(self, name: str, run: motion.Run, goal: ArmPosition, source: str) -> Action:
        halt = self._client.robotic_arm.stop
        return self._motions.start(name, run, halt, resource=ARM, goal=goal, source=source)

    async def _arrive(self, goal: ArmPosition) -> None:
        async def left() -> float:
            await self.refresh()
            return math.hypot(goal.x - self._position.x, goal.z - self._position.z)

        await self._motions.arrive(left, GOOD, "the arm")
