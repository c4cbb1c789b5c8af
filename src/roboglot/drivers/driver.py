"""What every driver is: it gives a robot its components at once, connects when it is started, keeps it connected."""

from __future__ import annotations

from abc import ABC, abstractmethod

from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link
from roboglot.model.robot import Robot


class Driver(ABC):
    """Made with a robot that has nothing yet; adds the components that any robot of its protocol has.

    What only some have is added when the robot is reached for the first time. ``address`` is the robot's URL. Not
    ``touches``: the robot is only watched, and what is found out or kept by telling it something is left out.
    """

    def __init__(self, robot: Robot, address: str, *, touches: bool = True) -> None:
        self.robot = robot
        health = robot[Health] if Health in robot else robot.add(Health, Health(robot.clock, robot.events))
        self.link = robot.add(Link, Link(address, robot.clock, robot.events, health))
        self.supervisor = Supervisor(self.link, robot.clock, self.begin, self.serve)
        self.supervisor.touches = touches

    async def start(self, *, wait: bool) -> None:
        """Connect from now on. ``wait``: return when the first try is over; never raises for a robot that is away."""
        self.supervisor.start()
        if wait:
            await self.supervisor.first_try()

    async def close(self) -> None:
        """Let go of the robot. Whatever moved it was cancelled before, by the fleet."""
        await self.supervisor.close(self.brake())
        await self.hang_up()

    @abstractmethod
    async def begin(self) -> None:
        """Connect and learn what the robot has. Raises ClientError, OSError."""

    @abstractmethod
    async def serve(self) -> None:
        """Until the link breaks: ClientError, OSError."""

    @abstractmethod
    async def brake(self) -> None:
        """Returns when the robot has been told to stand still, or cannot be."""

    @abstractmethod
    async def hang_up(self) -> None:
        """For good."""
