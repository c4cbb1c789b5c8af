"""Values between the world and its pictures: an eye, moving figures at an instant, a scene to draw."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.bodies.hull import Hull
    from roboglot.simulation.rendering.floor_plan import Plan
    from roboglot.simulation.rendering.shapes import Floats, Mesh

PLACES = 6  # behind the point, of m and of directions
REACH = 0.5  # m by which shadows and arms extend beyond the radius


@dataclass(frozen=True, slots=True)
class Eye:
    """Pose of a camera (world, m); the rows of ``rotation`` are right, down and ahead in world.

    ``fov``: horizontal, rad.
    """

    x: float
    y: float
    z: float
    rotation: NDArray[np.float64]
    fov: float

    @property
    def yaw(self) -> float:
        """Direction of view from above, rad."""
        return math.atan2(self.rotation[2, 1], self.rotation[2, 0])

    @property
    def level(self) -> bool:
        """True if the eye looks neither steeply up or down nor askew."""
        return abs(float(self.rotation[2, 2])) < 0.5 and abs(float(self.rotation[0, 2])) < 0.2

    def key(self) -> tuple[object, ...]:
        """Return a key that is equal for eyes that see the same."""
        return (*_place(self), self.fov)

    @property
    def spread(self) -> float:
        """Horizontal angle that may be visible, rad: a full turn for a steep view, else ``fov`` and a margin."""
        return min(math.tau, 1.25 * self.fov) if self.level else math.tau


@dataclass(frozen=True, slots=True)
class Ground:
    """Floor and ceiling: a paint per room, then the ceiling's; heights in world."""

    paints: NDArray[np.float32]
    textures: NDArray[np.int32]
    floor: float
    ceiling: float


@dataclass(frozen=True, slots=True)
class Figure:
    """A person or thing that may move: function for its mesh at the origin, pose (world, m), shadow's radius (m)."""

    make: Callable[[], Mesh]
    x: float
    y: float
    z: float
    rotation: Floats
    radius: float


@dataclass(frozen=True, slots=True)
class Instant:
    """Moving figures of a floor at one instant."""

    floor: int
    figures: tuple[Figure, ...]

    def key(self) -> tuple[object, ...]:
        """Return a key that is equal only for instants that look the same; may run in any thread."""
        figures = self.figures
        places = tuple((*_place(figure), figure.radius) for figure in figures)
        return self.floor, places, tuple(figure.make() for figure in figures)


def _place(thing: Eye | Figure) -> tuple[object, ...]:
    """Return position and attitude in steps that are too small to be seen: what lies still trembles in the physics."""
    steps = (round(value, PLACES) for value in (thing.x, thing.y, thing.z))
    return (*steps, (thing.rotation.round(PLACES) + 0.0).tobytes())  # + 0.0: no negative zeros


@dataclass(frozen=True, slots=True)
class Scene:
    """One instant of one floor, complete for drawing in another thread."""

    meshes: tuple[Mesh, ...]
    ground: Ground
    plan: Plan
    shadows: NDArray[np.uint8]
    masks: NDArray[np.uint32]


class Scenery(Protocol):
    """Scenery of one world for its cameras."""

    def instant(self, number: int, viewer: Hull, eye: Eye, /) -> Instant:
        """Return the figures before the eye on a floor now, without the viewer."""

    def scene(self, instant: Instant, /) -> Scene:
        """Return everything to draw; may run in any thread."""
