"""The map of a dog: pushes 6001 and 6003."""

from __future__ import annotations

from roboglot.drivers.reported import ReportedMapping
from roboglot.model.errors import Refused
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid


class CyberDogMapping(ReportedMapping):
    """Map from pushes 6001 and 6003; read-only."""

    @property
    def enabled(self) -> bool:
        return False

    def enable(self, on: bool) -> None:
        if on:
            raise Refused("this robot maps by a task of its app")

    @property
    def closes_loops(self) -> bool:
        return False

    def close_loops(self, on: bool) -> None:
        raise Refused("this robot does not report loop closure")

    def clear(self) -> None:
        raise Refused("this robot's map belongs to its app")

    def load(self, grid: OccupancyGrid, pose: Pose, *, origin: Pose | None = None) -> None:
        raise Refused("this robot's map belongs to its app")

    def move_origin(self, point: Point) -> Point:
        raise Refused("this robot's map belongs to its app")
