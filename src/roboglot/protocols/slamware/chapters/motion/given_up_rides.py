"""Rides that were given up in the car: the robot is where the car brings it, and needs that floor's map."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import ExitStack

from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.map_memory import Drawings, exchange
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.events import FloorReached
from roboglot.model.geometry import Pose
from roboglot.protocols.slamware.chapters.artifact.drawing import seen_from
from roboglot.protocols.slamware.chapters.motion.lift_rides import shared_elevators, stop_at
from roboglot.protocols.slamware.chapters.multi_floor.elevators import elevators_here
from roboglot.protocols.slamware.context import Context

log = logging.getLogger(__name__)


class GivenUpRides:
    """Uses the map of the floor that the robot has come to without a ride."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._entering: asyncio.Task[None] | None = None
        self._end: Callable[[], None] | None = None

    def start(self) -> None:
        """Begin to follow the robot."""
        if Floors in self._context.robot:
            self._end = self._context.robot.events.listen(FloorReached, self._reached)

    def close(self) -> None:
        """End following the robot."""
        if self._end is not None:
            self._end()
        if self._entering is not None:
            self._entering.cancel()

    def _reached(self, event: FloorReached) -> None:
        waiting = ExitStack()
        waiting.enter_context(exchange(self._context.robot))  # that names of places are looked up on this floor
        self._entering = asyncio.get_running_loop().create_task(self._enter(event), name="entering a floor")
        self._entering.add_done_callback(lambda _: waiting.close())

    async def _enter(self, event: FloorReached) -> None:
        robot, maps = self._context.robot, self._context.maps
        try:
            floor = next((floor for floor in maps.floors if stop_at(self._context, floor.name) == event.floor), None)
            shared = shared_elevators(robot, floor) if floor else []
            if floor is None or not shared:
                stop = robot[LiftClient].floors[event.floor]
                await maps.leave_floors(stop, self._car(event.place))
                raise NotFound(f"no loaded floor has a map of the lift's stop {stop}")
            _, landing = shared[0]
            await maps.enter(floor.name.building, floor.name.floor, landing.inside.compose(event.place))
            robot[Floors].set_lift(landing.waiting(), landing.inside)
        except RobotError as error:
            log.warning("robot %s was brought to a floor whose map it cannot use: %s", robot.id, error)

    def _car(self, place: Pose) -> Drawings:
        """Return the car's area, if only one is drawn, as seen from the robot at ``place`` in it."""
        now, elevators = self._context.robot[MapAnnotations].current, elevators_here(self._context.robot)
        if len(elevators) != 1:
            return Drawings((), Annotations(last_id=now.last_id))
        (elevator,) = elevators
        drawn = Drawings((), Annotations(areas=(elevator.area,), last_id=now.last_id))
        return seen_from(elevator.inside.compose(place), drawn)
