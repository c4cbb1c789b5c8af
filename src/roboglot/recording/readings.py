"""Sensor readings that recordings, bags, Foxglove and ROS 2 have once a second: the rows of ``READINGS``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING

from roboglot.model.components.component import Component
from roboglot.model.components.sensing.barometer import Barometer, BarometerReading
from roboglot.model.robot import Robot
from roboglot.values import dataclass

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One sensor's reading.

    topic: its last word (``/a/pressure``), which is the entries' kind, too.
    component: interface of the sensor. ``read``: returns its reading.
    value: dataclass of the reading, with numbers only; they are the fields of its JSON.
    ros: type of its ROS message, which begins with a header. ``ros_fields``: from the JSON's fields to the message's.
    """

    topic: str
    component: type[Component]
    read: Callable[[Robot], object]
    value: type[DataclassInstance]
    ros: str
    ros_fields: Callable[[Mapping[str, float]], Mapping[str, float]]

    @property
    def schema(self) -> str:
        """Name of its JSON schema."""
        return f"roboglot.{self.topic.title().replace('_', '')}"

    @property
    def names(self) -> tuple[str, ...]:
        """Fields of its JSON."""
        return tuple(field.name for field in fields(self.value))


READINGS = (
    Reading(
        topic="pressure",
        component=Barometer,
        read=lambda robot: robot[Barometer].reading,
        value=BarometerReading,
        ros="sensor_msgs/msg/FluidPressure",
        ros_fields=lambda json: {"fluid_pressure": json["pressure"], "variance": json["deviation"] ** 2},
    ),
)
BY_SCHEMA: Mapping[str, Reading] = {reading.schema: reading for reading in READINGS}


def readings_of(robot: Robot) -> Iterator[tuple[str, object]]:
    """Yield topic and value of each reading that the robot has a sensor for."""
    for reading in READINGS:
        if reading.component in robot:
            yield reading.topic, reading.read(robot)
