"""Types of the commands' parameters: ranges as in the manual and, where they differ, as on robots.

``OnRobots`` annotates ranges of real robots, which the profiles of their builds use instead.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class OnRobots:
    """Type that replaces the annotated one in profiles of robots' builds."""

    kind: object


SpeedXY = Annotated[float, Meta(ge=-3.5, le=3.5)]  # m/s
SpeedZ = Annotated[float, Meta(ge=-600, le=600)]  # degrees/s
DistanceXY = Annotated[float, Meta(ge=-5, le=5)]  # m
AngleZ = Annotated[float, Meta(ge=-1800, le=1800)]  # degrees; the text says int, clients send 30.000000
TopSpeedXY = Annotated[float, Meta(gt=0, le=3.5), OnRobots(Annotated[float, Meta(ge=0.1, le=2.5)])]  # m/s
TopSpeedZ = Annotated[float, Meta(gt=0, le=600), OnRobots(Annotated[float, Meta(ge=10, le=540)])]  # degrees/s
WheelSpeed = Annotated[float, Meta(ge=-1000, le=1000)]  # rpm; the text says int, clients send floats

GimbalSpeed = Annotated[float, Meta(ge=-450, le=450), OnRobots(Annotated[float, Meta(ge=-540, le=540)])]  # degrees/s
GimbalTopSpeed = Annotated[float, Meta(ge=0, le=540)]  # degrees/s
PitchBy = Annotated[float, Meta(ge=-55, le=55)]  # degrees
YawBy = Annotated[float, Meta(ge=-55, le=55), OnRobots(Annotated[float, Meta(ge=-500, le=500)])]  # degrees
PitchTo = Annotated[float, Meta(ge=-25, le=30), OnRobots(Annotated[float, Meta(ge=-20, le=35)])]  # degrees
YawTo = Annotated[float, Meta(ge=-250, le=250)]  # degrees

Beads = Annotated[int, Meta(ge=1, le=5), OnRobots(Annotated[int, Meta(ge=1, le=8)])]
Sensitivity = Annotated[int, Meta(ge=1, le=10), OnRobots(Annotated[int, Meta(ge=0, le=10)])]
PortMask = Annotated[int, Meta(ge=0, le=0xFFFF)]  # bit n-1 is output n
Percent = Annotated[float, Meta(ge=0, le=100)]
Hertz = Annotated[int, Meta(ge=1, le=50_000)]  # the manual prints no range
ColourPart = Annotated[int, Meta(ge=0, le=255)]
BlinkRate = Annotated[int, Meta(ge=1, le=10)]  # Hz
LampNumber = Annotated[int, Meta(ge=1, le=8)]
AdapterId = Annotated[int, Meta(ge=1, le=6)]
AdapterPort = Annotated[int, Meta(ge=1, le=2)]
RangeSensorId = Annotated[int, Meta(ge=1, le=4)]
ServoId = Annotated[int, Meta(ge=1, le=3)]
ServoAngle = Annotated[float, Meta(ge=-180, le=180)]  # degrees
ServoSpeed = Annotated[float, Meta(ge=-1800, le=1800)]  # degrees/s
ArmDistance = Annotated[float, Meta(ge=-1000, le=1000)]  # cm, robots mm; the manual's range is empty: the arm decides
Level = Annotated[int, Meta(ge=1, le=4)]
MarkerDistance = Annotated[float, Meta(ge=0.5, le=3)]  # m

Rate = Literal[1, 5, 10, 20, 30, 50]  # Hz
OnOff = Literal["on", "off"]
Switch = Literal["on", "off", ""]  # "": the attribute was named without a switch
LineColour = Literal["red", "blue", "green"]
MarkerColour = Annotated[Literal["red", "blue"], OnRobots(Literal["red", "blue", "green"])]
Exposure = Literal["default", "small", "medium", "large"]
Effect = Literal["solid", "off", "pulse", "blink", "scrolling"]
