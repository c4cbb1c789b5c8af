"""The infrared distance chapter (manual 3.2.11)."""

from __future__ import annotations

import math

from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.errors import NotFound
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import OnOff, RangeSensorId
from roboglot.protocols.robomaster.table import TABLE


@TABLE.on("ir_distance_sensor measure", right=Right.SEE, needs=(RangeSensors,))
def measure(context: Context, switch: OnOff) -> None:
    """Switch all sensors (3.2.11.1); off at the end of the session."""
    sensors = context.robot[RangeSensors]
    sensors.measure(switch == "on")
    context.at_end("ir measure", lambda: sensors.measure(False))


@TABLE.on("ir_distance_sensor distance ?", right=Right.SEE, needs=(RangeSensors,))
def get_distance(context: Context, id: RangeSensorId) -> tuple[float, ...]:
    """Return the distance at sensor id (front, left, rear, right), mm (3.2.11.2); real robots: cm.

    0 while switched off; the end of the sensor's range if nothing is within it.
    """
    sensors = context.robot[RangeSensors]
    if id > len(sensors.names):
        raise NotFound(f"this robot has {len(sensors.names)} distance sensors")
    reading = sensors.reading(sensors.names[id - 1])
    if reading is None:
        return (0.0,)
    distance = reading.distance if math.isfinite(reading.distance) else reading.range_max
    return (round(distance * (100 if context.profile.as_robots else 1000), 1),)
