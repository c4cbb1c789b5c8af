"""Servos at the extension ports of an EP."""

from __future__ import annotations

import math

from roboglot.clients.errors import RefusedByRobot
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster import motion
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.motion.servo import Servos, servo_resource
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.geometry import bounded, wrap_angle
from roboglot.model.robot import Robot

COUNT_MAX = 3
GOOD = math.radians(1.0)


class RoboMasterServos(Servos):
    """The servos that answer, without gaps from the first on. The robot alone sets how fast they go to an angle."""

    limit, speed = math.pi, math.radians(1800)

    def __init__(self, robot: Robot, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._robot, self._client, self._supervisor = robot, client, supervisor
        self._motions = motion.Motions(robot, supervisor)
        self._angles: list[float] = []

    async def probe(self) -> None:
        """Probe the servos. Raises RefusedByRobot if there is none."""
        self._angles = [await self._ask(1)]
        try:
            for number in range(2, COUNT_MAX + 1):
                self._angles.append(await self._ask(number))
        except RefusedByRobot:
            pass
        self.count = len(self._angles)

    async def refresh(self) -> None:
        """Poll the angles."""
        for index in range(self.count):
            self._angles[index] = await self._ask(index + 1)

    def angle(self, number: int) -> float:
        return self._angles[self._index(number)]

    def move_to(self, number: int, angle: float, *, speed: float | None = None, source: str = "") -> Action:
        index = self._index(number)
        if speed is not None:
            raise Refused("this robot sets the speed of its servos itself")
        if not abs(angle) <= self.limit + 1e-9:
            raise InvalidGoal(f"a servo goes to at most {self.limit:.4g} rad, not {angle}")

        async def left() -> float:
            self._angles[index] = await self._ask(number)
            return abs(wrap_angle(angle - self._angles[index]))

        async def run() -> None:
            await self._client.servo.angle(number, round(math.degrees(angle), 3))
            await self._motions.arrive(left, GOOD, f"servo {number}")

        return self._start("move servo", number, run, angle, source)

    def set_speed(self, number: int, speed: float, *, source: str = "") -> Action:
        self._index(number)
        if not math.isfinite(speed):
            raise InvalidGoal("a speed must be finite")
        cut = bounded(speed, self.speed)

        async def run() -> None:
            await self._client.servo.speed(number, round(math.degrees(cut), 3))
            while cut:
                await self._robot.clock.sleep(motion.PERIOD)
                self._supervisor.link.require()

        return self._start("turn servo", number, run, cut, source)

    def stop(self, number: int | None = None) -> None:
        for each in range(1, self.count + 1) if number is None else (self._index(number) + 1,):
            for action in self._robot.actions.running(servo_resource(each)):
                action.cancel("the servo was stopped")
        self._supervisor.send("stopping servos", self._client.servo.stop(number), always=True)

    async def _ask(self, number: int) -> float:
        return math.remainder(math.radians(await self._client.servo.get_angle(number)), math.tau)

    def _index(self, number: int) -> int:
        if not 1 <= number <= self.count:
            raise NotFound(f"there is no servo {number}; they are 1 to {self.count}")
        return number - 1

    def _start(self, name: str, number: int, run: motion.Run, goal: float, source: str) -> Action:
        async def halt() -> None:
            await self._client.servo.stop(number)

        resource = servo_resource(number)
        return self._motions.start(name, run, halt, resource=resource, goal=goal, source=source)
