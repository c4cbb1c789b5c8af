"""One order from start to end: stops, target, and handover to people."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

from roboglot.autonomy.delivery.drive import DeliveryDrive, Failed
from roboglot.autonomy.delivery.handover import Handover, Signal, Signals
from roboglot.autonomy.delivery.order_book import OrderBook, OrderChanges
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.delivery import Failure, Order, OrderKind, OrderStage, PickUp
from roboglot.model.events import DeliveryNews
from roboglot.model.robot import Robot


class Round:
    """Execution of ``order``, with its progress written to the book."""

    def __init__(self, robot: Robot, book: OrderBook, driver: DeliveryDrive, signals: Signals, order: Order) -> None:
        self._robot, self._book, self._driver, self._signals = robot, book, driver, signals
        self._order = order

    async def run(self) -> None:
        """Carry out the order. Raises Failed with the first failure."""
        if self._order.request.kind is OrderKind.DISINFECT:
            raise Failed(Failure.NO_DISINFECTION)
        await self._shut_boxes()
        done = {result.stop for result in self._order.results if result.stop}
        for number, stop in enumerate(self._order.request.stops):
            if stop in done:
                continue
            if self._order.request.kind is OrderKind.STATION and not number:
                await self._load(stop)
            else:
                await self._visit(stop, self._wait(number))
        await self._set(stage=OrderStage.DRIVING, stop="")
        await self._driver.go_to(self._order.request.target, self._book.policy, self._book.policy.delivery_speed)
        await self._set(stage=OrderStage.AT_TARGET)
        self._driver.report(DeliveryNews.ARRIVED)
        await self._meet()
        for result in self._order.results:
            if result.box and result.failure:
                raise Failed(result.failure)

    def _wait(self, number: int) -> float:
        """Return the waiting time at a stop, s; 0: until a person ends it."""
        waits = self._order.request.waits
        return waits[number] if number < len(waits) else 0.0

    async def _load(self, cabinet: str) -> None:
        """Drive to a cabinet, open the boxes, and wait until all are filled. Raises Failed."""
        policy, handover, boxes = self._book.policy, self._handover(), self._order.request.boxes
        await self._set(stage=OrderStage.DRIVING_TO_CABINET, stop=cabinet)
        await self._driver.go_to(cabinet, policy, policy.delivery_speed)
        await self._set(stage=OrderStage.AT_CABINET)
        self._driver.report(DeliveryNews.AT_CABINET)
        failure = await handover.open(boxes) or await handover.filled(boxes, policy.pickup_seconds)
        for box in boxes:
            failure = await handover.shut(box) or failure
        if failure:
            raise Failed(failure)
        await self._note(PickUp(stop=cabinet))

    async def _visit(self, stop: str, seconds: float) -> None:
        """Drive to a stop and wait for the people there. Raises Failed."""
        policy = self._book.policy
        await self._set(stage=OrderStage.DRIVING_TO_STOP, stop=stop)
        await self._driver.go_to(stop, policy, policy.delivery_speed)
        await self._set(stage=OrderStage.AT_STOP)
        await self._operate(stop, seconds)

    async def _operate(self, stop: str, seconds: float) -> None:
        """Wait for the people at a stop; a timeout fails the stop, not the order. ``seconds``: 0 is until they end."""
        patience = seconds or self._book.policy.pickup_seconds
        done = await self._signals.wait_for(Signal.OPERATION_DONE, seconds=patience) or seconds > 0.0
        await self._note(PickUp(stop=stop, failure=None if done else Failure.NOT_TAKEN))

    async def _meet(self) -> None:
        policy, kind = self._book.policy, self._order.request.kind
        match kind:
            case OrderKind.GUIDE | OrderKind.RETURN | OrderKind.DISINFECT:
                return
            case OrderKind.ROUND:
                await self._operate(self._order.request.target, self._wait(len(self._order.request.stops)))
            case OrderKind.FOOD | OrderKind.RECYCLE:
                served = await self._signals.wait_for(Signal.END, Signal.OPERATION_DONE, seconds=policy.food_seconds)
                if not served and kind is OrderKind.FOOD:
                    raise Failed(Failure.NOT_TAKEN)
            case OrderKind.DISTRIBUTE:
                await self._open_all()
            case OrderKind.TAKEOUT | OrderKind.COLLECT | OrderKind.STATION:
                await self._hand_over()

    async def _hand_over(self) -> None:
        policy, order = self._book.policy, self._order
        done = {result.box for result in order.results if result.box}
        left = [box for box in order.request.boxes if box not in done]
        seconds = policy.collect_seconds if order.request.kind is OrderKind.COLLECT else policy.pickup_seconds
        if not await self._signals.wait_for(Signal.START, seconds=seconds):
            for box in left:
                await self._note(PickUp(box, failure=Failure.NOT_TAKEN))
            return
        await self._set(stage=OrderStage.HANDING_OVER)
        await self._handover().one_by_one(left, opened=False)

    async def _open_all(self) -> None:
        boxes = self._order.request.boxes
        handover = self._handover()
        if failure := await handover.open(boxes):
            raise Failed(failure)
        await self._set(stage=OrderStage.HANDING_OVER)
        await handover.all_at_once(boxes)

    async def _shut_boxes(self) -> None:
        """Close the order's boxes before driving. Raises Failed."""
        if Cargo in self._robot:
            for box in self._order.request.boxes:
                if failure := await self._handover().shut(box):
                    raise Failed(failure)

    def _handover(self) -> Handover:
        return Handover(self._robot, self._signals, self._note, self._book.policy.door_seconds)

    async def _note(self, result: PickUp) -> None:
        results = tuple(r for r in self._order.results if (r.box, r.stop) != (result.box, result.stop))
        await self._set(results=(*results, result))

    async def _set(self, **changes: Unpack[OrderChanges]) -> None:
        self._order = replace(self._order, **changes)
        await self._book.change(self._order.id, **changes)
