"""Sensors that are switched off, and those of them that stay off across restarts."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot

MASKED = "slamware.masked_sensors"  # the setting that holds the ids of sensors that stay off across restarts


class Masks:
    """Stores a robot's masks, then applies them: one that cannot be stored changes nothing."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._turn = asyncio.Lock()  # of changes

    async def set_masks(
        self, edit: Callable[[Mapping[int, bool]], Mapping[int, bool]], settings: Mapping[str, object] | None = None
    ) -> None:
        """Replace the masks (ids; True: until unmasked) by ``edit`` of them; store ``settings`` in the same write."""
        async with self._turn:
            masks = edit(self._robot[SensorMasks].masked if SensorMasks in self._robot else {})
            always = sorted(id for id, stays in masks.items() if stays)
            await self._robot[Settings].put_all({MASKED: always, **(settings or {})})
            self._apply(masks)

    def restore(self) -> None:
        """Restore the masks at a start: exactly those that are to be off always."""
        if SensorMasks in self._robot and Settings in self._robot:
            self._apply(dict.fromkeys(self._robot[Settings].get(MASKED, []), True))

    def _apply(self, masks: Mapping[int, bool]) -> None:
        if SensorMasks not in self._robot:
            return
        for sensor in self._robot[SensorMasks].sensors:
            if sensor.id in masks:
                self._robot[SensorMasks].mask(sensor.id, always=masks[sensor.id])
            else:
                self._robot[SensorMasks].unmask(sensor.id)
