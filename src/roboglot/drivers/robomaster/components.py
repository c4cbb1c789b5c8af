"""Optional components of an EP: probed at every connection, added when they first answer."""

from __future__ import annotations

from roboglot.clients.errors import RefusedByRobot
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.capabilities import add_if_present
from roboglot.drivers.robomaster.chapters.ai.ai import RoboMasterVision
from roboglot.drivers.robomaster.chapters.arm import RoboMasterArm
from roboglot.drivers.robomaster.chapters.armor import RoboMasterArmor
from roboglot.drivers.robomaster.chapters.blaster import RoboMasterBlaster
from roboglot.drivers.robomaster.chapters.camera import RoboMasterCamera, RoboMasterVideo, video_feed
from roboglot.drivers.robomaster.chapters.chassis import RoboMasterImu, RoboMasterMotionStatus
from roboglot.drivers.robomaster.chapters.game import RoboMasterInput
from roboglot.drivers.robomaster.chapters.gimbal import RoboMasterGimbal
from roboglot.drivers.robomaster.chapters.gripper import RoboMasterGripper
from roboglot.drivers.robomaster.chapters.ir_distance import RoboMasterRanges
from roboglot.drivers.robomaster.chapters.led import RINGS, RoboMasterLight
from roboglot.drivers.robomaster.chapters.pwm import RoboMasterPwm
from roboglot.drivers.robomaster.chapters.sensor_adapter import RoboMasterAdapters
from roboglot.drivers.robomaster.chapters.servo import RoboMasterServos
from roboglot.drivers.robomaster.chapters.sound import (
    RoboMasterAudio,
    RoboMasterHearing,
    RoboMasterMicrophone,
    audio_feed,
)
from roboglot.drivers.robomaster.state import ReportedState
from roboglot.drivers.robomaster.telemetry import PushedParts, Refresh
from roboglot.drivers.supervisor import Supervisor
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
from roboglot.model.components.motion.motion_status import MotionStatus
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.pwm import PwmPorts
from roboglot.model.robot import Robot

REFUSED = (RefusedByRobot,)


class OptionalComponents:
    """Holds every optional component. ``refreshed`` lists the polls of present components without pushes."""

    def __init__(self, robot: Robot, client: RoboMasterClient, supervisor: Supervisor, reported: ReportedState) -> None:
        clock = robot.clock
        self._robot, self._supervisor = robot, supervisor
        self._imu = RoboMasterImu(client, reported)
        self._status = RoboMasterMotionStatus(client, reported)
        self._gimbal = RoboMasterGimbal(robot, client, supervisor, reported)
        self._arm = RoboMasterArm(robot, client, supervisor)
        self._gripper = RoboMasterGripper(robot, client, supervisor)
        self._servos = RoboMasterServos(robot, client, supervisor)
        self._ranges = RoboMasterRanges(clock, client, supervisor)
        self._blaster = RoboMasterBlaster(clock, client, supervisor)
        self._armor = RoboMasterArmor(client, supervisor)
        self._light = RoboMasterLight(clock, client, supervisor)
        self._pwm = RoboMasterPwm(client, supervisor)
        self._adapters = RoboMasterAdapters(robot, client, supervisor.link)
        heard = audio_feed(clock, client, supervisor)
        pictures = video_feed(clock, client, supervisor)
        self._microphone = RoboMasterMicrophone(clock, client, heard)
        self._audio = RoboMasterAudio(self._microphone, clock, heard)
        self._hearing = RoboMasterHearing(clock, client, supervisor)
        self._input = RoboMasterInput(client, supervisor)
        self._camera = RoboMasterCamera(clock, client, supervisor, reported, pictures)
        self._vision = RoboMasterVision(clock, client, supervisor, self._camera)
        self._video = RoboMasterVideo(self._camera, clock, pictures)
        self._recorder = Recorder(self._video, clock)
        self.refreshed: list[Refresh] = []

    async def probe(self) -> PushedParts:
        """Probe every component; return those that are pushed. Raises ClientError if the robot is gone."""
        robot = self._robot
        self.refreshed.clear()
        # An EP has both, so an answer that does not come is the link's fault.
        attitude = await add_if_present(robot, Imu, self._imu, self._imu.probe(), absent=REFUSED)
        status = await add_if_present(robot, MotionStatus, self._status, self._status.probe(), absent=REFUSED)
        gimbal = await add_if_present(robot, Gimbal, self._gimbal, self._gimbal.probe())
        if await add_if_present(robot, Arm, self._arm, self._arm.refresh()):
            self.refreshed.append(self._arm.refresh)
        if await add_if_present(robot, Gripper, self._gripper, self._gripper.refresh()):
            self.refreshed.append(self._gripper.refresh)
        if await add_if_present(robot, Servos, self._servos, self._servos.probe()):
            self.refreshed.append(self._servos.refresh)
        if await add_if_present(robot, RangeSensors, self._ranges, self._ranges.probe()):
            self.refreshed.append(self._ranges.refresh)
        await add_if_present(robot, Blaster, self._blaster, self._blaster.probe())
        await add_if_present(robot, Armor, self._armor, self._armor.probe(gimbal=gimbal))
        if gimbal:
            self._light.provide(RINGS)
        if self._supervisor.touches:
            await add_if_present(robot, Light, self._light, self._light.probe())
            await add_if_present(robot, PwmPorts, self._pwm, self._pwm.probe())
        if await add_if_present(robot, SensorAdapters, self._adapters, self._adapters.probe()):
            self.refreshed.append(self._adapters.refresh)
        await add_if_present(robot, InputDevice, self._input, self._input.probe())
        await add_if_present(robot, Hearing, self._hearing, self._hearing.probe())
        await add_if_present(robot, Vision, self._vision, self._vision.probe())
        if await add_if_present(robot, Microphone, self._microphone, self._microphone.probe()):
            await add_if_present(robot, AudioStream, self._audio)
        if self._supervisor.touches and await add_if_present(robot, Camera, self._camera, self._camera.probe()):
            await add_if_present(robot, VideoStream, self._video)
            await add_if_present(robot, Recorder, self._recorder)
        return PushedParts(attitude, status, gimbal)
