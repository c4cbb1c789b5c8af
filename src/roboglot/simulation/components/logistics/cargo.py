"""Cargo boxes with doors that take time, stall on hands, and lock. People load them through ``put``."""

from __future__ import annotations

import uuid
from typing import Annotated, Literal

from msgspec import Meta, Struct

from roboglot.model.actions import Action
from roboglot.model.components.logistics.cargo import BOX, BoxState, Cargo, Compartment, DoorState, Stock
from roboglot.model.errors import Blocked, NotFound, Refused
from roboglot.model.events import BoxChanged
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.values import dataclass

LOOK = 0.02  # s between two checks of a door's position
PINCH_BACK = 0.3  # of its travel by which a stalled door opens again
LOCKED_BELOW = 1e-6
NAMESPACE = uuid.UUID("5d3c53f2-8a51-4b29-9e54-62b0a4f0b9b1")  # of the compartments' ids


class CompartmentSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A compartment: ``boxes`` side by side."""

    orientation: Literal["front", "back", "top"] = "front"
    kind: Literal["takeout", "retail"] = "takeout"
    boxes: Annotated[int, Meta(ge=1, le=20)] = 1


class CargoSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Compartments from the bottom up; ``door_time``: s for a door's full travel."""

    compartments: Annotated[tuple[CompartmentSection, ...], Meta(min_length=1, max_length=20)]
    door_time: Positive


@dataclass(slots=True)
class _Box:
    """State of a box: ``opening`` 0..1; ``moving`` -1 (closing), 0, 1 (opening)."""

    id: int
    opening: float = 0.0
    moving: int = 0
    fill: float = 0.0
    hand: bool = False  # an object is in the door
    jammed: bool = False  # the motor has no force
    error: str = ""

    def state(self) -> BoxState:
        if self.moving:
            door = DoorState.OPENING if self.moving > 0 else DoorState.CLOSING
        elif self.opening <= LOCKED_BELOW:
            door = DoorState.CLOSED
        else:
            door = DoorState.OPEN if self.opening >= 1.0 else DoorState.HALF_OPEN
        stock = Stock.EMPTY if self.fill <= 0.0 else Stock.FULL if self.fill >= 0.9 else Stock.PARTLY
        locked = door is DoorState.CLOSED
        return BoxState(self.id, door, locked, stock, (self.error,) if self.error else ())


class SimulatedCargo(Cargo):
    """Cargo whose doors open and close at one speed; a door is locked exactly while closed."""

    def __init__(self, section: CargoSection, robot: Robot) -> None:
        self._section, self._robot = section, robot
        self._boxes: dict[int, _Box] = {}
        compartments = []
        for layer, part in enumerate(section.compartments):
            first = len(self._boxes)
            ids = tuple(range(first, first + part.boxes))
            self._boxes.update((id, _Box(id)) for id in ids)
            name = str(uuid.uuid5(NAMESPACE, f"{robot.description.serial} {layer}"))
            compartments.append(Compartment(name, layer, part.orientation, layer, part.kind, ids))
        self.compartments = tuple(compartments)

    def box(self, id: int) -> BoxState:
        return self._get(id).state()

    def open_box(self, id: int, *, source: str = "") -> Action:
        return self._start(self._get(id), 1, source)

    def close_box(self, id: int, *, source: str = "") -> Action:
        return self._start(self._get(id), -1, source)

    # -- people's actions --

    def put(self, id: int, fill: float) -> None:
        """Set the fill level of a box (0..1). Raises Refused unless its door is open, ValueError out of range."""
        box = self._get(id)
        if not 0.0 <= fill <= 1.0:
            raise ValueError("the fill level of a box is 0 to 1")
        if box.opening < 0.5:
            raise Refused(f"the door of box {id} is not open")
        box.fill = fill
        self._publish(box)

    def hold_hand_into(self, id: int, there: bool) -> None:
        """Put a hand or a parcel into the door, or take it out. Raises NotFound."""
        self._get(id).hand = there

    def jam(self, id: int, jammed: bool) -> None:
        """Make the door's motor fail, or work again. Raises NotFound."""
        self._get(id).jammed = jammed

    # ------------------------------------------------------------------------------------------------------------------

    def _start(self, box: _Box, direction: int, source: str) -> Action:
        async def run(action: Action) -> None:
            await self._move(box, direction, action)

        name = "open box" if direction > 0 else "close box"
        return self._robot.actions.start(
            name, run, resources={f"{BOX}{box.id}"}, goal=box.id, source=source, pausable=True
        )

    async def _move(self, box: _Box, direction: int, action: Action) -> None:
        """Move the door to its end; at any end of the action, stop the door. Raises Blocked."""
        box.error = ""
        end = 1.0 if direction > 0 else 0.0
        try:
            while box.opening != end:
                self._set_moving(box, direction)
                await action.hold(lambda: self._set_moving(box, 0))
                await self._robot.clock.sleep(LOOK)
                if box.jammed:
                    raise self._failed(box, "the door's motor does not move")
                if direction < 0 and box.hand:
                    box.opening = min(1.0, max(box.opening, PINCH_BACK))
                    raise self._failed(box, "something is in the door")
                step = direction * LOOK / self._section.door_time
                box.opening = min(1.0, max(0.0, box.opening + step))
        finally:
            self._set_moving(box, 0)

    def _failed(self, box: _Box, reason: str) -> Blocked:
        box.error = reason
        return Blocked(f"box {box.id}: {reason}")

    def _set_moving(self, box: _Box, moving: int) -> None:
        if moving != box.moving:
            box.moving = moving
            self._publish(box)

    def _publish(self, box: _Box) -> None:
        self._robot.events.publish(BoxChanged(stamp=self._robot.clock.time(), box=box.state()))

    def _get(self, id: int) -> _Box:
        try:
            return self._boxes[id]
        except KeyError:
            raise NotFound(f"there is no box {id}") from None


def _fit(fit: Fitting) -> SimulatedCargo:
    return SimulatedCargo(fit.body[CargoSection], fit.robot)


PART = Part(name="cargo", interface=Cargo, section=CargoSection, fit=_fit)
