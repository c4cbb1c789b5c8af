"""The boxes of a Slamware delivery robot."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.slamware.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.logistics.cargo import BoxState, Cargo, Compartment, DoorState, Stock
from roboglot.model.errors import Blocked, Expired, NotFound
from roboglot.model.events import BoxChanged
from roboglot.model.robot import Robot
from roboglot.wire.slamware.chapters.delivery import Box

PERIOD = 0.2  # s between two polls
MOVED_WITHIN = 60.0  # s until a door must have opened or closed
DOORS = {
    "OPEN": DoorState.OPEN,
    "OPENING": DoorState.OPENING,
    "CLOSING": DoorState.CLOSING,
    "CLOSED": DoorState.CLOSED,
    "SEMIOPEN": DoorState.HALF_OPEN,
}
STOCKS = {"EMPTY": Stock.EMPTY, "SEMIFULL": Stock.PARTLY, "FULL": Stock.FULL}


class SlamwareCargo(Cargo):
    """``delivery/v1/cargos``. A moving door cannot be stopped; cancelling only stops polling it."""

    def __init__(self, robot: Robot, client: SlamwareClient, supervisor: Supervisor) -> None:
        self._robot, self._client, self._supervisor = robot, client, supervisor
        self.compartments: Sequence[Compartment] = ()
        self._boxes: dict[int, BoxState] = {}

    async def refresh(self) -> None:
        """Poll all boxes. Raises SlamwareRefused for a robot without cargo."""
        cargos = await self._client.get_cargos()
        self.compartments = tuple(
            Compartment(c.id, c.pos, c.orientation.lower(), c.layer, c.type.lower(), tuple(b.id for b in c.boxes))
            for c in cargos
        )
        boxes = {box.id: box_of(box) for cargo in cargos for box in cargo.boxes}
        changed = [box for id, box in boxes.items() if self._boxes.get(id, box) != box]
        self._boxes = boxes
        for box in changed:
            self._robot.events.publish(BoxChanged(stamp=self._robot.clock.time(), box=box))

    def box(self, id: int) -> BoxState:
        try:
            return self._boxes[id]
        except KeyError:
            raise NotFound(f"there is no box {id}") from None

    def open_box(self, id: int, *, source: str = "") -> Action:
        return self._start("open box", id, ":open", source)

    def close_box(self, id: int, *, source: str = "") -> Action:
        return self._start("close box", id, ":close", source)

    def _start(self, name: str, id: int, operation: str, source: str) -> Action:
        self._supervisor.link.require()
        self.box(id)
        cargo = next(part.id for part in self.compartments if id in part.boxes)

        async def run(_: Action) -> None:
            with robot_errors():
                begun = self._robot.clock.time()
                await self._client.operate_box(cargo, id, operation)
                while (result := await self._client.get_operation_result(cargo, id)).stage == "IN_PROGRESS":
                    if self._robot.clock.time() - begun > MOVED_WITHIN:
                        raise Expired(f"the door of box {id} still moves")
                    await self._robot.clock.sleep(PERIOD)
                await self.refresh()
            if result.stage == "FAILED":
                raise Blocked(result.reason or f"box {id} did not {operation[1:]}")

        return self._robot.actions.start(name, run, resources={f"box {id}"}, goal=id, source=source)


def box_of(box: Box) -> BoxState:
    """Return the model's state of a box."""
    door = DOORS.get(box.door_status, DoorState.HALF_OPEN)
    stock = STOCKS.get(box.stock_status, Stock.PARTLY)
    return BoxState(box.id, door, box.lock_status == "LOCKED", stock, tuple(box.errors))
