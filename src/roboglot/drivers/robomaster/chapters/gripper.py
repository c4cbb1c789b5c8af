"""The gripper of an EP. The manual and real robots number its states differently."""

from __future__ import annotations

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster import motion
from roboglot.drivers.robomaster.vocabulary import gripper_status
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.motion.gripper import GRIPPER, Gripper, GripperStatus, check_level
from roboglot.model.errors import Blocked
from roboglot.model.robot import Robot

OPENINGS = {GripperStatus.CLOSED: 0.0, GripperStatus.BETWEEN: 0.05, GripperStatus.OPEN: 0.10}  # m
CLOSING_SECONDS = 2.8  # at level 1; shorter at higher levels
SPARE_SECONDS = 0.5  # tolerated delay of a motion


class RoboMasterGripper(Gripper):
    """``opening`` follows from the three states that the robot reports."""

    def __init__(self, robot: Robot, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._robot, self._client, self._supervisor = robot, client, supervisor
        self._motions = motion.Motions(robot, supervisor)
        self._status = GripperStatus.BETWEEN

    async def refresh(self) -> None:
        """Poll the status."""
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
        self._supervisor.send("stopping the gripper", self._client.robotic_gripper.stop(), always=True)

    def _start(self, goal: GripperStatus, level: int, source: str) -> Action:
        check_level(level)
        gripper, clock = self._client.robotic_gripper, self._robot.clock

        async def run() -> None:
            await (gripper.open(level) if goal is GripperStatus.OPEN else gripper.close(level))
            until = clock.time() + CLOSING_SECONDS / level + SPARE_SECONDS
            while clock.time() < until:
                await self.refresh()
                if self._status is goal:
                    return
                self._supervisor.link.require()
                await clock.sleep(motion.PERIOD)
            if goal is GripperStatus.OPEN or self._status is GripperStatus.OPEN:
                raise Blocked(f"the gripper remains {self._status}")  # otherwise it grips an object

        name = f"{'open' if goal is GripperStatus.OPEN else 'close'} gripper"
        return self._motions.start(name, run, gripper.stop, resource=GRIPPER, goal=goal, source=source)
