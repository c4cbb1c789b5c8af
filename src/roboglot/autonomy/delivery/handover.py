"""Handover at the target: people signal begin and end, boxes open and close. Knows no driving and no queue."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from enum import Enum

from roboglot.autonomy.delivery.drive import SOURCE
from roboglot.model.actions import ActionStatus
from roboglot.model.components.logistics.cargo import Cargo, DoorState, Stock
from roboglot.model.components.logistics.delivery import BoxChoice, Failure, PickUp
from roboglot.model.errors import NotFound, Refused
from roboglot.model.events import BoxChanged
from roboglot.model.robot import Robot

FILLED_LOOK = 1.0  # s between two checks of the boxes
SHUT_RETRY = 5.0  # s between two attempts to close a door that something blocks
Note = Callable[[PickUp], Awaitable[None]]


class Signal(Enum):
    """Signals of people to the robot."""

    START = "start"
    END = "end"
    OPERATION_DONE = "operation done"


class Signals:
    """Receiver of one awaited signal at a time."""

    def __init__(self, robot: Robot) -> None:
        self._clock = robot.clock
        self._awaited: tuple[Signal, ...] = ()
        self._heard: asyncio.Future[None] | None = None

    def receive(self, signal: Signal) -> None:
        """Take a person's signal. Raises Refused unless it is awaited."""
        if self._heard is None or self._heard.done() or signal not in self._awaited:
            raise Refused("the robot does not wait for that now")
        self._heard.set_result(None)

    async def wait_for(self, *signals: Signal, seconds: float) -> bool:
        """Wait for one of the signals; return False after ``seconds``."""
        self._awaited, self._heard = signals, asyncio.get_running_loop().create_future()
        try:
            await self._clock.wait_for(self._heard, seconds)
        except TimeoutError:
            return False
        finally:
            self._heard = None
        return True


class Handover:
    """Handover of boxes at one place. ``note`` is called with each box's result."""

    def __init__(self, robot: Robot, signals: Signals, note: Note, door_seconds: float) -> None:
        self._robot, self._signals, self._note = robot, signals, note
        self._door_seconds = door_seconds

    async def one_by_one(self, boxes: Sequence[BoxChoice], *, opened: bool) -> None:
        """Hand over box by box; a person opens the first one, unless ``opened``, and the robot the others."""
        for number, choice in enumerate(boxes):
            failure = await self.open([choice]) if number or opened else None
            if failure is None:
                failure = await self._serve(choice)
            await self._note(PickUp(choice, failure=failure))

    async def all_at_once(self, boxes: Sequence[BoxChoice]) -> None:
        """Wait while people use the open boxes, then close them all."""
        done = await self._signals.wait_for(Signal.END, seconds=self._door_seconds)
        for choice in boxes:
            failure = None if done or self._empty(choice) else Failure.NOT_TAKEN
            await self._note(PickUp(choice, failure=await self.shut(choice) or failure))

    async def open(self, boxes: Sequence[BoxChoice]) -> Failure | None:
        """Open boxes at the same time; return the failure, if any."""
        try:
            actions = [self._robot[Cargo].open_box(choice.box, source=SOURCE) for choice in boxes]
        except NotFound:
            return Failure.NO_BOX
        except Refused:  # an emergency stop holds the doors
            return Failure.DOOR_STUCK
        stuck = [await action.done() is ActionStatus.ABORTED for action in actions]
        return Failure.DOOR_STUCK if any(stuck) else None

    async def filled(self, boxes: Sequence[BoxChoice], seconds: float) -> Failure | None:
        """Wait up to ``seconds`` until no box is empty; return the failure, if any."""
        clock, cargo = self._robot.clock, self._robot[Cargo]
        patience = clock.time() + seconds
        while any(cargo.box(choice.box).stock is Stock.EMPTY for choice in boxes):
            if clock.time() >= patience:
                return Failure.NOT_LOADED
            await clock.sleep(FILLED_LOOK)
        return None

    async def shut(self, choice: BoxChoice) -> Failure | None:
        """Close a box, again and again if something is in the door; return the failure, if any."""
        cargo, clock = self._robot[Cargo], self._robot.clock
        patience = clock.time() + self._door_seconds
        while cargo.box(choice.box).door is not DoorState.CLOSED:
            if await self._close(choice.box):
                break
            if clock.time() >= patience:
                return Failure.DOOR_OPEN
            await clock.sleep(SHUT_RETRY)
        return None

    async def _close(self, box: int) -> bool:
        """Close a box; return whether it is closed, and False while an emergency stop holds the doors."""
        try:
            return await self._robot[Cargo].close_box(box, source=SOURCE).done() is ActionStatus.SUCCEEDED
        except Refused:
            return False

    async def _serve(self, choice: BoxChoice) -> Failure | None:
        """Wait for the person's end or a timeout, then close the box; return the failure, if any."""
        cargo = self._robot[Cargo]
        try:
            was_open = cargo.box(choice.box).door is not DoorState.CLOSED
        except NotFound:
            return Failure.NO_BOX

        def look(event: BoxChanged) -> None:
            nonlocal was_open
            was_open = was_open or (event.box.id == choice.box and event.box.door is not DoorState.CLOSED)

        stop = self._robot.events.listen(BoxChanged, look)
        try:
            done = await self._signals.wait_for(Signal.END, seconds=self._door_seconds)
        finally:
            stop()
        taken = was_open and (done or self._empty(choice))
        return await self.shut(choice) or (None if taken else Failure.NOT_TAKEN)

    def _empty(self, choice: BoxChoice) -> bool:
        return self._robot[Cargo].box(choice.box).stock is Stock.EMPTY
