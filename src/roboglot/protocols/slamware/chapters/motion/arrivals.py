"""Arrivals on floors: the robot is where the lift's car brings it, and needs that floor's map."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable
from contextlib import ExitStack

from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import Drawings, exchange
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.events import FloorReached, PoseConfirmed
from roboglot.model.geometry import Pose
from roboglot.protocols.slamware.chapters.artifact.drawing import seen_from
from roboglot.protocols.slamware.chapters.motion.lift_rides import shared_elevators, stop_at
from roboglot.protocols.slamware.chapters.multi_floor.elevators import car_around, elevators_here
from roboglot.protocols.slamware.context import Context

log = logging.getLogger(__name__)


class Arrivals:
    """Uses the map of the floor that the robot has come to."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._entering: asyncio.Task[None] | None = None
        self._end: Callable[[], None] | None = None
        self._end_look: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Begin to follow the robot."""
        if Floors in self._context.robot:
            self._end = self._context.robot.events.listen(FloorReached, self._reached)
            self._context.maps.entered = self._declare

    def close(self) -> None:
        """End following the robot."""
        if self._end is not None:
            self._end()
        self._end_look()
        if self._entering is not None:
            self._entering.cancel()

    def follow_car(self) -> None:
        """Use the map of the car's floor, once scans confirm that the robot was switched on in a car.

        The car may have gone on while the robot was off, and floors look alike from there.
        """
        self._end_look()
        if Floors in self._context.robot and car_around(self._context.robot) is not None:
            self._end_look = self._context.robot.events.listen(PoseConfirmed, lambda _: self._look())

    def _look(self) -> None:
        self._end_look()
        robot, car = self._context.robot, car_around(self._context.robot)
        with contextlib.suppress(RobotError):  # the lift is out of reach, or does not stop here
            state = robot[LiftClient].state
            if car and state.target is None and state.floor != stop_at(self._context, self._context.maps.current):
                place = robot[Localization].pose.relative_to(car.aboard)
                self._reached(FloorReached(stamp=robot.clock.time(), floor=state.floor, place=place))

    def _declare(self) -> None:
        """Tell the lift's rides on which floor the robot is."""
        with contextlib.suppress(RobotError):  # the lift does not stop there
            self._context.robot[Floors].begin_on(stop_at(self._context, self._context.maps.current))

    def _reached(self, event: FloorReached) -> None:
        self._end_look()
        waiting = ExitStack()
        waiting.enter_context(exchange(self._context.robot))  # that names of places are looked up on this floor
        self._entering = asyncio.get_running_loop().create_task(self._enter(event), name="entering a floor")
        self._entering.add_done_callback(lambda _: waiting.close())

    async def _enter(self, event: FloorReached) -> None:
        robot, maps = self._context.robot, self._context.maps
        try:
            floor = next((floor for floor in maps.floors if stop_at(self._context, floor.name) == event.floor), None)
            shared = shared_elevators(robot, floor) if floor else []
            if floor is None or not (shared or event.place is None):
                stop = robot[LiftClient].floors[event.floor]
                await maps.leave_floors(stop, self._car_alone(event.place))
                raise NotFound(f"no loaded floor has a map of the lift's stop {stop}")
            landing = shared[0][1] if shared else None
            pose = landing.aboard.compose(event.place) if landing and event.place else None
            await maps.enter(floor.name.building, floor.name.floor, pose)
            if landing is not None:
                robot[Floors].set_lift(landing.entrance, landing.aboard)
        except RobotError as error:
            log.warning("robot %s was brought to a floor whose map it cannot use: %s", robot.id, error)

    def _car_alone(self, place: Pose | None) -> Drawings:
        """Return the car's area, if only one is drawn, as seen from the robot at ``place`` in it; None: elsewhere."""
        now, elevators = self._context.robot[MapAnnotations].current, elevators_here(self._context.robot)
        if len(elevators) != 1 or place is None:
            return Drawings((), Annotations(last_id=now.last_id))
        (elevator,) = elevators
        drawn = Drawings((), Annotations(areas=(elevator.area,), last_id=now.last_id))
        return seen_from(elevator.aboard.compose(place), drawn)
