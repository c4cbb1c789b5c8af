"""The EP's arm and gripper. The manual measures the arm in cm from where it was at power-on, robots in mm from the
shoulder; and they number the gripper's states differently.
"""

from __future__ import annotations

import math

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster import motion
from roboglot.drivers.robomaster.vocabulary import gripper_status
from roboglot.drivers.supervisor import Keeper
from roboglot.model.actions import Action
from roboglot.model.components.motion.arm import (
    ARM,
    Arm,
    ArmPosition,
    ArmReach,
)
from roboglot.model.components.motion.gripper import (
    GRIPPER,
    LEVEL_MAX,
    Gripper,
    GripperStatus,
)
from roboglot.model.errors import Blocked, InvalidGoal
from roboglot.model.robot import Robot

HOME = ArmPosition(0.091, 0.041)
REACH = ArmReach(ArmPosition(0.07, -0.06), ArmPosition(0.22, 0.15), 0.24)
GOOD = 0.002  # m
OPENINGS = {GripperStatus.CLOSED: 0.0, GripperStatus.BETWEEN: 0.05, GripperStatus.OPEN: 0.10}  # m
CLOSING_SECONDS, SPARE_SECONDS = 2.8, 0.5  # at level 1, shorter at higher ones; and what it may take longer


class RoboMasterArm(Arm):
    """``reach`` and ``home`` are those of an EP as it is delivered; the robot refuses what it does not reach."""

    reach, home = REACH, HOME

    def __init__(self, robot: Robot, client: RoboMasterClient, keeper: Keeper) -> None:
        self._robot, self._client, self._keeper = robot, client, keeper
        self._position = HOME

    async def refresh(self) -> None:
        """Ask where it is."""
        told = await self._client.robotic_arm.get_position()
        unit, origin = self._scale
        self._position = ArmPosition(origin.x + told.x * unit, origin.z + told.y * unit)

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
        self._keeper.send("stopping the arm", self._client.robotic_arm.stop())

    @property
    def _scale(self) -> tuple[float, ArmPosition]:
        """Metres per unit, and the origin."""
        return (0.001, ArmPosition()) if self._client.as_robots else (0.01, self.home)

    def _start(self, name: str, run: motion.Run, goal: ArmPosition, source: str) -> Action:
        halt = self._client.robotic_arm.stop
        return motion.start(self._robot, self._keeper, name, run, halt, resource=ARM, goal=goal, source=source)

    async def _arrive(self, goal: ArmPosition) -> None:
        async def left() -> float:
            await self.refresh()
            return math.hypot(goal.x - self._position.x, goal.z - self._position.z)

        await motion.arrive(self._robot.clock, self._keeper, left, GOOD, "the arm")


class RoboMasterGripper(Gripper):
    """``opening`` goes with the three states that the robot tells."""

    def __init__(self, robot: Robot, client: RoboMasterClient, keeper: Keeper) -> None:
        self._robot, self._client, self._keeper = robot, client, keeper
        self._status = GripperStatus.BETWEEN

    async def refresh(self) -> None:
        """Ask how it stands."""
        self._status = gripper_status(await self._client.robotic_gripper.get_status(), self._client.as_robots)

    @property
    def status(self) -> GripperStatus:
        return self._status

    @property
    def opening(self) -> float:
        return OPENINGS[self._status]

    def open(self, level: int = 1, *, source: str = "") -> Action:
        return self._start(GripperStatus.OPEN, level, source)

    def close(self, level: int = 1, *, source: str = "") -> Action:
        return self._start(GripperStatus.CLOSED, level, source)

    def stop(self) -> None:
        for action in self._robot.actions.running(GRIPPER):
            action.cancel("the gripper was stopped")
        self._keeper.send("stopping the gripper", self._client.robotic_gripper.stop())

    def _start(self, goal: GripperStatus, level: int, source: str) -> Action:
        if not 1 <= level <= LEVEL_MAX:
            raise InvalidGoal(f"a gripper's level is 1 to {LEVEL_MAX}, not {level}")
        gripper, clock = self._client.robotic_gripper, self._robot.clock

        async def run() -> None:
            await (gripper.open(level) if goal is GripperStatus.OPEN else gripper.close(level))
            until = clock.time() + CLOSING_SECONDS / level + SPARE_SECONDS
            while clock.time() < until:
                await self.refresh()
                if self._status is goal:
                    return
                self._keeper.link.require()
                await clock.sleep(motion.PERIOD)
            if goal is GripperStatus.OPEN or self._status is GripperStatus.OPEN:
                raise Blocked(f"the gripper stays {self._status}")  # else it holds something

        name = f"{'open' if goal is GripperStatus.OPEN else 'close'} gripper"
        return motion.start(
            self._robot, self._keeper, name, run, gripper.stop, resource=GRIPPER, goal=goal, source=source
        )
