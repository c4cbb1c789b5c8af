"""Components of an EP and where they are only approximate. Source of the capability page."""

from __future__ import annotations

from roboglot.media.audio import AudioStream
from roboglot.media.recorder import Recorder
from roboglot.media.video import VideoStream
from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.armor import Armor
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.input_device import InputDevice
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.motion.arm import Arm
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper
from roboglot.model.components.motion.motion_status import MotionStatus
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.pwm import PwmPorts

# Component to a plain description of what is approximate about it; empty if exact.
APPROXIMATIONS: dict[type[Component], str] = {
    Base: "",
    Driving: "",  # autonomy's, over the wheels and odometry
    Odometry: "",
    Imu: "only where the robot has one; angles are the robot's; rates are worked out from them, and of accelerations "
    "only gravity is known",
    MotionStatus: "only where the robot has one",
    Battery: "the charge alone: no volts, and not whether it is charged",
    Gimbal: "only where the robot has one, as all that follows; changes by other clients are not visible",
    Arm: "its reach and where it begins are those of an EP as it is delivered; asked ten times a second",
    Gripper: "closed, between or open: no width",
    Servos: "a motion's speed is the robot's",
    RangeSensors: "asked ten times a second; taken to look ahead, left, back and right",
    Blaster: "reports neither magazine nor fired beads; a shot under way cannot be cancelled",
    Armor: "",
    Light: "dark when it is connected; shows five effects, blinks at whole Hz, and breathes at the robot's pace",
    Camera: "four exposures; its mount and angle are those of an EP as it is delivered",
    VideoStream: "",
    Recorder: "",
    Microphone: "packets as they arrive; the robot sends only while a client listens",
    AudioStream: "",
    Hearing: "applause as the robot counts it; no speech",
    Vision: "distances by the size of boxes; one of people, gestures, markers (red or blue) and robots at a time; no "
    "faces, skeletons and codes",
    InputDevice: "as the robot reports it while a client listens; keys cannot be pressed from here",
    PwmPorts: "six; assumed at rest until they are set",
    SensorAdapters: "inputs are polled in turn, each within 1.2 s; level changes arrive at once",
    Health: "only the state of the link",
    Link: "",
}
