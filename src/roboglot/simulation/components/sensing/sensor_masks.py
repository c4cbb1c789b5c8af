"""Masks that switch off bumpers, cliff sensors and depth cameras."""

from __future__ import annotations

from roboglot.model.components.sensing.sensor_masks import Sensor, SensorKind, SensorMasks
from roboglot.model.errors import NotFound
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.sensing.bumper import SimulatedBumper
from roboglot.simulation.components.sensing.cliff import SimulatedCliff
from roboglot.simulation.components.sensing.depth_camera import SimulatedDepthCamera


class SimulatedSensorMasks(SensorMasks):
    """Masks of the robot's maskable sensors, numbered from 0."""

    def __init__(
        self, bumper: SimulatedBumper | None, cliff: SimulatedCliff | None, depth: SimulatedDepthCamera | None
    ) -> None:
        self._bumper, self._cliff, self._depth = bumper, cliff, depth
        places = [(SensorKind.BUMPER, zone) for zone in (bumper.zones if bumper else ())]
        places += [(SensorKind.CLIFF, zone) for zone in (cliff.zones if cliff else ())]
        places += [(SensorKind.DEPTH_CAMERA, "front")] if depth else []
        self.sensors = tuple(Sensor(id, kind, zone) for id, (kind, zone) in enumerate(places))
        self._masked: dict[int, bool] = {}

    @property
    def masked(self) -> dict[int, bool]:
        return dict(self._masked)

    def mask(self, id: int, *, always: bool = False) -> None:
        self._check(id)
        self._masked[id] = always
        self._apply()

    def unmask(self, id: int) -> None:
        self._check(id)
        self._masked.pop(id, None)
        self._apply()

    def masks(self, kind: SensorKind, zone: str) -> bool:
        return zone in self._zones(kind)

    def _check(self, id: int) -> None:
        if not 0 <= id < len(self.sensors):
            raise NotFound(f"there is no sensor {id}")

    def _zones(self, kind: SensorKind) -> frozenset[str]:
        return frozenset(self.sensors[id].zone for id in self._masked if self.sensors[id].kind is kind)

    def _apply(self) -> None:
        if self._bumper:
            self._bumper.masked = self._zones(SensorKind.BUMPER)
        if self._cliff:
            self._cliff.masked = self._zones(SensorKind.CLIFF)
        if self._depth:
            self._depth.masked = bool(self._zones(SensorKind.DEPTH_CAMERA))


def _fit(fit: Fitting) -> SimulatedSensorMasks | None:
    bumper, cliff, depth = fit.find(SimulatedBumper), fit.find(SimulatedCliff), fit.find(SimulatedDepthCamera)
    return SimulatedSensorMasks(bumper, cliff, depth) if bumper or cliff or depth else None


PART = Part(name="sensor_masks", interface=SensorMasks, fit=_fit, after=("bumper", "cliff", "depth_camera"))
