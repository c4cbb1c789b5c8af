"""Infrared distance sensors, polled while they measure. Their mounts are assumed."""

from __future__ import annotations

import math

from roboglot.clients.errors import RefusedByRobot
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import Clock
from roboglot.model.components.sensing.range_sensor import RangeReading, RangeSensors
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose

NAMES = ("ir_1", "ir_2", "ir_3", "ir_4")
FACINGS = (0.0, math.pi / 2, math.pi, -math.pi / 2)  # assumed: front, left, rear, right
RANGE_MIN, RANGE_MAX, FIELD_OF_VIEW, HEIGHT = 0.05, 10.0, 0.35, 0.07


class RoboMasterRanges(RangeSensors):
    """The sensors that answer, without gaps from the first on."""

    def __init__(self, clock: Clock, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._clock, self._client, self._supervisor = clock, client, supervisor
        self._readings: dict[str, RangeReading] = {}
        self._measuring = False

    async def probe(self) -> None:
        """Probe the sensors and resume measuring. Raises RefusedByRobot if there is none."""
        count = 0
        try:
            for count in range(len(NAMES)):
                await self._client.ir_distance_sensor.get_distance(count + 1)
            count = len(NAMES)
        except RefusedByRobot:
            if not count:
                raise
        self.names = NAMES[:count]
        self._readings.clear()
        if self._measuring:
            await self._client.ir_distance_sensor.measure(True)

    async def refresh(self) -> None:
        """Poll all distances while they measure."""
        if not self._measuring:
            return
        unit = 0.01 if self._client.as_robots else 0.001
        for number, (name, facing) in enumerate(zip(self.names, FACINGS, strict=False), 1):
            distance = await self._client.ir_distance_sensor.get_distance(number) * unit
            if distance <= 0.0 or not self._measuring:  # not measured yet
                continue
            self._readings[name] = RangeReading(
                stamp=self._clock.time(),
                distance=max(distance, RANGE_MIN) if distance < RANGE_MAX - 1e-6 else math.inf,
                range_min=RANGE_MIN,
                range_max=RANGE_MAX,
                field_of_view=FIELD_OF_VIEW,
                mount=Pose(yaw=facing),
                height=HEIGHT,
            )

    @property
    def measuring(self) -> bool:
        return self._measuring

    def measure(self, on: bool) -> None:
        self._supervisor.send("switching the distance sensors", self._client.ir_distance_sensor.measure(on))
        self._measuring = on
        self._readings.clear()

    def reading(self, name: str) -> RangeReading | None:
        if name not in self.names:
            raise NotFound(f"there is no distance sensor {name!r}")
        return self._readings.get(name)
