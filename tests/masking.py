"""Switches a robot's bumper off, for tests of wheels that go on pushing."""

from __future__ import annotations

from roboglot.model.components.sensing.sensor_masks import SensorKind, SensorMasks
from roboglot.model.robot import Robot


def mask_bumper(robot: Robot) -> None:
    """Disable the guard that stops the wheels when the robot pushes against something."""
    masks = robot[SensorMasks]
    for sensor in masks.sensors:
        if sensor.kind is SensorKind.BUMPER:
            masks.mask(sensor.id)
