"""Opens a world's stage; imports it, and with it the kernels, only then."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from roboglot.kernels import loading
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.lift import LiftCar
from roboglot.simulation.building.props import Props
from roboglot.simulation.building.things import Thing
from roboglot.simulation.people.people import Walker
from roboglot.simulation.rendering.views import Scenery
from roboglot.simulation.world.beads import Beads
from roboglot.simulation.world.description import WorldDescription


def stage_of(
    world: WorldDescription,
    hulls: Sequence[Hull],
    walkers: Sequence[Walker],
    props: Props,
    things: Iterable[Thing],
    life: tuple[Mapping[str, Robot], Beads, LiftCar | None],
) -> Callable[[], Scenery]:
    """Return a function that opens the world's stage, to be called for the first camera."""

    def open_stage() -> Scenery:
        with loading():
            from roboglot.simulation.rendering.stage import MovingThings, Stage

        return Stage(world, hulls, walkers, props, things, MovingThings(*life))

    return open_stage
