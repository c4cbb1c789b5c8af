"""What an EP becomes in the model, and what of it is only nearly so. The capability page is made of this."""

from __future__ import annotations

from roboglot.model.components.base import Base
from roboglot.model.components.battery import Battery
from roboglot.model.components.component import Component
from roboglot.model.components.driving import Driving
from roboglot.model.components.gimbal import Gimbal
from roboglot.model.components.health import Health
from roboglot.model.components.imu import Imu
from roboglot.model.components.link import Link
from roboglot.model.components.motion_status import MotionStatus
from roboglot.model.components.odometry import Odometry

# Component to what is approximate about it, in plain words; empty: nothing.
ANNOUNCED: dict[type[Component], str] = {
    Base: "",
    Driving: "",  # autonomy's, over the wheels and odometry
    Odometry: "",
    Imu: "angles are the robot's; rates are worked out from them, and of accelerations only gravity is known",
    MotionStatus: "",
    Battery: "the charge alone: no volts, and not whether it is charged",
    Gimbal: "only where the robot has one; what other clients switch is not seen",
    Health: "only the state of the link",
    Link: "",
}
