"""What an EP carries besides wheels: each part is asked for at every connection, and added when it first answers."""

from __future__ import annotations

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.capabilities import announce
from roboglot.drivers.robomaster.adapters import RoboMasterAdapters
from roboglot.drivers.robomaster.arm import RoboMasterArm, RoboMasterGripper
from roboglot.drivers.robomaster.camera import RoboMasterCamera, RoboMasterVideo, film
from roboglot.drivers.robomaster.combat import RoboMasterArmor, RoboMasterBlaster
from roboglot.drivers.robomaster.gimbal import RoboMasterGimbal
from roboglot.drivers.robomaster.light import RINGS, RoboMasterLight
from roboglot.drivers.robomaster.newest import Newest
from roboglot.drivers.robomaster.pilot import RoboMasterInput
from roboglot.drivers.robomaster.pwm import RoboMasterPwm
from roboglot.drivers.robomaster.ranges import RoboMasterRanges
from roboglot.drivers.robomaster.servos import RoboMasterServos
from roboglot.drivers.robomaster.sounds import RoboMasterAudio, RoboMasterHearing, RoboMasterMicrophone, waves
from roboglot.drivers.robomaster.vision import RoboMasterVision
from roboglot.drivers.robomaster.watch import Refresh
from roboglot.drivers.supervisor import Keeper
from roboglot.media.audio import AudioStream
from roboglot.media.recorder import Recorder
from roboglot.media.video import VideoStream
from roboglot.model.components.interaction.armor import Armor
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.input_device import InputDevice
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.motion.arm import Arm
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.pwm import PwmPorts
from roboglot.model.robot import Robot


class Outfit:
    """``refreshed``: how to ask those parts that there are for what they do not push."""

    def __init__(self, robot: Robot, client: RoboMasterClient, keeper: Keeper, newest: Newest) -> None:
        clock = robot.clock
        self._robot, self._keeper = robot, keeper
        self._gimbal = RoboMasterGimbal(robot, client, keeper, newest)
        self._arm, self._gripper = RoboMasterArm(robot, client, keeper), RoboMasterGripper(robot, client, keeper)
        self._servos, self._ranges = RoboMasterServos(robot, client, keeper), RoboMasterRanges(clock, client, keeper)
        self._blaster, self._armor = RoboMasterBlaster(clock, client, keeper), RoboMasterArmor(client, keeper)
        self._light = RoboMasterLight(clock, client, keeper)
        self._pwm, self._adapters = RoboMasterPwm(client, keeper), RoboMasterAdapters(robot, client, keeper.link)
        heard, pictures = waves(clock, client, keeper), film(clock, client, keeper)
        self._microphone = RoboMasterMicrophone(clock, client, heard)
        self._audio = RoboMasterAudio(self._microphone, clock, heard)
        self._hearing = RoboMasterHearing(clock, client, keeper)
        self._input = RoboMasterInput(client, keeper)
        self._camera = RoboMasterCamera(clock, client, keeper, newest, pictures)
        self._vision = RoboMasterVision(clock, client, keeper, self._camera)
        self._video = RoboMasterVideo(self._camera, clock, pictures)
        self._recorder = Recorder(self._video, clock)
        self.refreshed: list[Refresh] = []

    async def learn(self) -> bool:
        """Ask for every part; returns whether there is a gimbal. Raises ClientError if the robot is gone."""
        robot = self._robot
        self.refreshed.clear()
        gimbal = await announce(robot, Gimbal, self._gimbal, self._gimbal.learn())
        if await announce(robot, Arm, self._arm, self._arm.refresh()):
            self.refreshed.append(self._arm.refresh)
        if await announce(robot, Gripper, self._gripper, self._gripper.refresh()):
            self.refreshed.append(self._gripper.refresh)
        if await announce(robot, Servos, self._servos, self._servos.learn()):
            self.refreshed.append(self._servos.refresh)
        if await announce(robot, RangeSensors, self._ranges, self._ranges.learn()):
            self.refreshed.append(self._ranges.refresh)
        await announce(robot, Blaster, self._blaster, self._blaster.learn())
        await announce(robot, Armor, self._armor, self._armor.learn(gimbal=gimbal))
        if gimbal:
            self._light.provide(RINGS)
        if self._keeper.touches:
            await announce(robot, Light, self._light, self._light.learn())
            await announce(robot, PwmPorts, self._pwm, self._pwm.learn())
        if await announce(robot, SensorAdapters, self._adapters, self._adapters.learn()):
            self.refreshed.append(self._adapters.refresh)
        await announce(robot, InputDevice, self._input, self._input.learn())
        await announce(robot, Hearing, self._hearing, self._hearing.learn())
        await announce(robot, Vision, self._vision, self._vision.learn())
        if await announce(robot, Microphone, self._microphone, self._microphone.learn()):
            await announce(robot, AudioStream, self._audio)
        if self._keeper.touches and await announce(robot, Camera, self._camera, self._camera.learn()):
            await announce(robot, VideoStream, self._video)
            await announce(robot, Recorder, self._recorder)
        return gimbal
