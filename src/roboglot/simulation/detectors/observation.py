"""Observation of the world by one robot's camera, shared by all detectors. Knows no kind of thing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Box
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.props import Props
from roboglot.simulation.detectors.tapes import Tape, tapes_of
from roboglot.simulation.people.people import Walker
from roboglot.simulation.rendering.projection import View
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.sightlines import Obstacles, SightLines
from roboglot.values import dataclass

Floats = NDArray[np.float64]
BOX_NOISE = 0.003  # of a box's size, one standard deviation
PIXEL_NOISE = 0.001  # of the picture's width
RANGE_NOISE = 0.02  # of the distance
BEARING_NOISE = math.radians(0.3)
MISSED = 0.01  # share of visible objects that are missed


class Surroundings:
    """Everything visible in a world, in its present state."""

    def __init__(
        self,
        world: WorldDescription,
        hulls: Sequence[Hull],
        walkers: Sequence[Walker],
        props: Props,
        lines: SightLines,
    ) -> None:
        self.world, self.hulls, self.walkers, self.props, self.lines = world, hulls, walkers, props, lines
        self._tapes: dict[int, list[Tape]] = {}

    def tapes(self, floor: int) -> list[Tape]:
        """Return the lines on a floor."""
        if floor not in self._tapes:
            self._tapes[floor] = tapes_of(self.world.floors[floor])
        return self._tapes[floor]


@dataclass(slots=True)
class Observation:
    """One instant's view; ``numbers``: the robot's numbers of people, kept between instants; ``names``: of faces."""

    around: Surroundings
    hull: Hull
    view: View
    random: np.random.Generator
    numbers: dict[str, int]
    names: Mapping[bytes, str]
    _obstacles: Obstacles | None = None

    @property
    def floor(self) -> int:
        """Floor of the robot."""
        return self.hull.floor

    @property
    def ground(self) -> float:
        """Elevation of the robot's floor (world), m."""
        return self.around.world.elevation(self.hull.floor)

    def visible(self, places: Floats, of: Hull | Walker | None = None) -> NDArray[np.bool_]:
        """Return which places (n, 3; world) are in the picture and unobstructed; ``of`` does not hide itself."""
        appear, _ = self.view.project(places)
        seen = self.view.inside(appear)
        if seen.any():
            if self._obstacles is None:
                self._obstacles = self.around.lines.now(self.floor)
            but = (self.hull,) if of is None else (self.hull, of)
            seen[seen] = self._obstacles.clear(self.view.at, places[seen], but)
        return seen

    def overlooked(self) -> bool:
        """Return True for a random share of calls, as detectors miss some objects."""
        return bool(self.random.random() < MISSED)

    def shaken(self, box: Box) -> Box:
        """Return the box with the detector's noise."""
        dx, dy, dw, dh = (self.random.standard_normal(4) * BOX_NOISE).tolist()
        return Box(box.x + dx * box.width, box.y + dy * box.height, box.width * (1.0 + dw), box.height * (1.0 + dh))

    def estimate(self, place: Floats) -> tuple[float, Point]:
        """Return a place's (world) noisy distance from the camera, m, and its noisy place in base_link."""
        off = place - self.view.at
        error, turn = self.random.standard_normal(2).tolist()
        scale = 1.0 + RANGE_NOISE * error
        at = self.view.at + off * scale
        seen = Pose(float(at[0]), float(at[1])).relative_to(self.hull.pose)
        turned = Pose(yaw=BEARING_NOISE * turn).compose(seen)
        return float(np.linalg.norm(off)) * scale, turned.point

    def bearing_from(self, pose: Pose) -> float:
        """Return the angle (rad, >= 0) between the x axis of ``pose`` (world) and the direction to the camera."""
        towards = math.atan2(self.view.at[1] - pose.y, self.view.at[0] - pose.x)
        return abs(math.remainder(towards - pose.yaw, math.tau))
