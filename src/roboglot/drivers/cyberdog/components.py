"""Optional components of a dog: probed at every connection, added when they first answer."""

from __future__ import annotations

import contextlib

from roboglot.clients.cyberdog import CyberDogClient
from roboglot.drivers.capabilities import add_if_present
from roboglot.drivers.cyberdog.chapters.camera import CyberDogCamera
from roboglot.drivers.cyberdog.chapters.people.audio import CyberDogSpeaker
from roboglot.drivers.cyberdog.chapters.system.power import CyberDogPower
from roboglot.drivers.cyberdog.chapters.system.skin import CyberDogSkin
from roboglot.drivers.cyberdog.telemetry import UNSUPPORTED, StatusPoll
from roboglot.drivers.supervisor import Supervisor
from roboglot.media.recorder import Recorder
from roboglot.media.video import VideoStream
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.skin import ElectronicSkin
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.system.network import Network
from roboglot.model.robot import Robot


class OptionalComponents:
    """Optional components of one dog."""

    def __init__(self, robot: Robot, client: CyberDogClient, supervisor: Supervisor, status: StatusPoll) -> None:
        self._robot, self._supervisor, self._status = robot, supervisor, status
        self._camera = CyberDogCamera(robot.clock, client, supervisor)
        self._video = VideoStream(self._camera, robot.clock)
        self._recorder = Recorder(self._video, robot.clock)
        self._speaker = CyberDogSpeaker(robot, client, supervisor, status)
        self._skin = CyberDogSkin(robot, client, supervisor)
        self._power = CyberDogPower(robot, client, supervisor, status)

    async def probe(self) -> None:
        """Probe the dog and add the components found. Raises LinkLost if the dog is gone."""
        with contextlib.suppress(*UNSUPPORTED):
            await self._status.ask()
        robot = self._robot
        if self._status.motors.temperatures:
            await add_if_present(robot, Motors, self._status.motors)
        if self._status.network.state.mac:
            await add_if_present(robot, Network, self._status.network)
        if self._status.volume is not None:
            await add_if_present(robot, Speaker, self._speaker)
        if self._supervisor.touches:
            await add_if_present(robot, Power, self._power, self._power.probe(), absent=UNSUPPORTED)
            await add_if_present(robot, ElectronicSkin, self._skin, self._skin.probe(), absent=UNSUPPORTED)
        if await add_if_present(robot, Camera, self._camera, self._camera.probe(), absent=UNSUPPORTED):
            await add_if_present(robot, VideoStream, self._video)
            await add_if_present(robot, Recorder, self._recorder)
