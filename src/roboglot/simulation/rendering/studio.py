"""Where a world's cameras are drawn: loads kernels when the first one is needed, works in threads in real time.

In lockstep everything is done in place, so that the same seed gives the same pictures at the same instants.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

from roboglot.kernels import loading
from roboglot.model.background import beside
from roboglot.model.clock import Clock, RealClock
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.lift import LiftCar
from roboglot.simulation.building.props import Props
from roboglot.simulation.building.things import Thing
from roboglot.simulation.people.people import Walker
from roboglot.simulation.world.beads import Beads
from roboglot.simulation.world.description import WorldDescription

if TYPE_CHECKING:
    from roboglot.simulation.rendering.picture import Renderer
    from roboglot.simulation.rendering.stage import Stage

R = TypeVar("R")


class Studio:
    """One per world; costs nothing until ``stage`` is asked for."""

    def __init__(
        self,
        world: WorldDescription,
        hulls: Sequence[Hull],
        walkers: Sequence[Walker],
        props: Props,
        things: Iterable[Thing],
        life: tuple[Mapping[str, Robot], Beads, LiftCar | None],
        clock: Clock,
    ) -> None:
        self._contents, self._life = (world, hulls, walkers, props, things), life
        self._threaded = isinstance(clock, RealClock)
        self._stage: Stage | None = None
        self._opening = asyncio.Lock()

    async def stage(self) -> Stage:
        """What can be seen; the first one to ask waits for the kernels (a second; longer if they must be compiled)."""
        async with self._opening:
            if self._stage is None:
                self._stage = await self.work(self._open)
        return self._stage

    def _open(self) -> Stage:
        with loading():
            from roboglot.simulation.rendering.stage import Life, Stage

        return Stage(*self._contents, Life(*self._life))

    async def renderer(self, width: int, height: int, fov: float) -> Renderer:
        """Buffers for one camera."""

        def make() -> Renderer:
            with loading():
                from roboglot.simulation.rendering.picture import Renderer

            return Renderer(width, height, fov)

        return await self.work(make)

    async def work(self, job: Callable[[], R]) -> R:
        """The result of ``job``, done beside the loop in real time."""
        return await beside(job) if self._threaded else job()
