"""Base class of all drivers: adds components to a robot, connects when started and keeps the connection up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager

from roboglot.clients.errors import LinkLost
from roboglot.drivers.errors import plain_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link
from roboglot.model.robot import Robot


class Driver(ABC):
    """Takes a bare robot and adds the components that every robot of its protocol has.

    Optional components are added at the first connection. ``address`` is the robot's URL. With ``touches`` false the
    driver only observes: it skips every component that must write to the robot to probe or keep its state.
    ``robot_errors``: context that raises the client's errors as the model's.
    """

    def __init__(
        self,
        robot: Robot,
        address: str,
        *,
        touches: bool = True,
        robot_errors: Callable[[], AbstractContextManager[None]] = plain_errors,
    ) -> None:
        self.robot = robot
        health = robot[Health] if Health in robot else robot.add(Health, Health(robot.clock, robot.events))
        self.link = robot.add(Link, Link(address, robot.clock, robot.events, health))
        self.supervisor = Supervisor(self.link, robot.clock, self.begin, self.serve, robot_errors)
        self.supervisor.touches = touches
        self._serial = ""

    def recognise(self, serial: str) -> None:
        """Remember the robot that answers. Raises LinkLost for another one, whose map and places are not this one's."""
        if serial and self._serial not in ("", serial):
            raise LinkLost(f"another robot answers now, {serial} instead of {self._serial}: restart to drive that one")
        self._serial = serial or self._serial

    async def start(self, *, wait: bool) -> None:
        """Connect, and keep trying. ``wait``: return after the first attempt. Never raises for an unreachable robot."""
        self.supervisor.start()
        if wait:
            await self.supervisor.first_try()

    async def close(self) -> None:
        """Brake and disconnect for good. The fleet cancels the robot's actions first."""
        await self.supervisor.close(self.brake())
        await self.hang_up()

    @abstractmethod
    async def begin(self) -> None:
        """Connect and probe the robot's components. Raises ClientError, OSError."""

    @abstractmethod
    async def serve(self) -> None:
        """Run until the link breaks. Raises ClientError, OSError."""

    @abstractmethod
    async def brake(self) -> None:
        """Command the robot to stand still; return when the command was sent or has failed."""

    @abstractmethod
    async def hang_up(self) -> None:
        """Close the connection for good."""
