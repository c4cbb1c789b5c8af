"""Masks sensors while the robot is inside an area that disables them, and unmasks them when it has left."""

from __future__ import annotations

from roboglot.autonomy.slam.belief import Belief
from roboglot.model.components.mapping.annotations import AreaKind, MapAnnotations
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.events import ScanTaken
from roboglot.model.robot import Robot


class AreaWatch:
    """Watch over areas at every scan. Sensors masked by others stay masked."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot, self._belief = robot, belief
        self._masked: set[int] = set()
        self._stop = robot.events.listen(ScanTaken, self._look)

    def close(self) -> None:
        """Stop looking."""
        self._stop()

    def _look(self, _: ScanTaken) -> None:
        areas = self._robot[MapAnnotations].current.areas_of(AreaKind.SENSOR_DISABLE)
        if not areas and not self._masked:
            return
        pose, masks = self._belief.pose, self._robot[SensorMasks]
        kinds = {kind for area in areas if area.contains(pose) for kind in area.sensors}
        wanted = {sensor.id for sensor in masks.sensors if sensor.kind in kinds}
        for id in wanted - masks.masked.keys():
            masks.mask(id)
            self._masked.add(id)
        for id in self._masked - wanted:
            masks.unmask(id)
        self._masked &= wanted
