"""Floors of the loaded map for the robot's other skills: their places, and rides between them."""

from __future__ import annotations

from roboglot.model.actions import Action
from roboglot.model.components.mapping.storeys import StoreyPlace
from roboglot.model.errors import InvalidGoal
from roboglot.protocols.slamware.chapters.motion.errands import Errand, run_errand
from roboglot.protocols.slamware.chapters.motion.lift_rides import car_to_leave, change_floor, home_floor
from roboglot.protocols.slamware.chapters.slam.composite import FloorName
from roboglot.protocols.slamware.context import Context


class LoadedStoreys:
    """Storeys of one robot. A floor's name is that of its building and its own."""

    def __init__(self, context: Context) -> None:
        self._context = context

    @property
    def current(self) -> str:
        """Floor whose map is in memory."""
        return _label(self._context.maps.current)

    def places(self) -> list[StoreyPlace]:
        """Return the places of floors that are not in memory."""
        others = (floor for floor in self._context.maps.floors if _label(floor.name) != self.current)
        return [StoreyPlace(_label(floor.name), place) for floor in others for place in floor.places]

    def home(self) -> str:
        """Return the floor of the home dock."""
        found = home_floor(self._context)
        return _label(found.name) if found else self.current

    @property
    def in_car(self) -> bool:
        """True if the robot is in a car whose door it can have opened."""
        return car_to_leave(self._context) is not None

    def go_to(self, floor: str, source: str) -> Action:
        """Drive to the floor by lift, or out of a car here."""
        found = next((known for known in self._context.maps.floors if _label(known.name) == floor), None)
        if found is None and floor != self.current:
            raise InvalidGoal(f"no floor {floor} is loaded")

        async def work(errand: Errand) -> None:
            await change_floor(self._context, errand, found)

        return run_errand(self._context.robot, "ride to another floor", work, floor, source=source)


def _label(name: FloorName) -> str:
    return f"{name.building}/{name.floor}" if name.building else name.floor
