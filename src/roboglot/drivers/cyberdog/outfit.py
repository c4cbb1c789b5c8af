"""What a dog has besides legs and lidar: asked for at every connection, added when it first answers."""

from __future__ import annotations

import contextlib

from roboglot.clients.cyberdog import CyberDogClient
from roboglot.drivers.capabilities import announce
from roboglot.drivers.cyberdog.camera import CyberDogCamera
from roboglot.drivers.cyberdog.condition import UNTOLD, Condition
from roboglot.drivers.cyberdog.power import CyberDogPower
from roboglot.drivers.cyberdog.skin import CyberDogSkin
from roboglot.drivers.cyberdog.speaker import CyberDogSpeaker
from roboglot.drivers.supervisor import Keeper
from roboglot.media.recorder import Recorder
from roboglot.media.video import VideoStream
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.skin import ElectronicSkin
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.system.network import Network
from roboglot.model.robot import Robot


class Outfit:
    """Those of one dog."""

    def __init__(self, robot: Robot, client: CyberDogClient, keeper: Keeper, condition: Condition) -> None:
        self._robot, self._keeper, self._condition = robot, keeper, condition
        self._camera = CyberDogCamera(robot.clock, client, keeper)
        self._video = VideoStream(self._camera, robot.clock)
        self._recorder = Recorder(self._video, robot.clock)
        self._speaker = CyberDogSpeaker(robot, client, keeper, condition)
        self._skin = CyberDogSkin(robot, client, keeper)
        self._power = CyberDogPower(robot, client, keeper, condition)

    async def learn(self) -> None:
        """Add what there is. Raises LinkLost if the dog is gone."""
        with contextlib.suppress(*UNTOLD):
            await self._condition.ask()
        robot = self._robot
        if self._condition.motors.temperatures:
            await announce(robot, Motors, self._condition.motors)
        if self._condition.network.state.mac:
            await announce(robot, Network, self._condition.network)
        if self._condition.volume is not None:
            await announce(robot, Speaker, self._speaker)
        if self._keeper.touches:
            await announce(robot, Power, self._power, self._power.learn(), absent=UNTOLD)
            await announce(robot, ElectronicSkin, self._skin, self._skin.learn(), absent=UNTOLD)
        if await announce(robot, Camera, self._camera, self._camera.learn(), absent=UNTOLD):
            await announce(robot, VideoStream, self._video)
            await announce(robot, Recorder, self._recorder)
