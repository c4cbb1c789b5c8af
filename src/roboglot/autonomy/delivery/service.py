"""The delivery service: accepts and cancels orders; the courier carries them out. Made of other skills."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from roboglot.autonomy.delivery.courier import Courier
from roboglot.autonomy.delivery.drive import DeliveryDrive
from roboglot.autonomy.delivery.handover import Signal, Signals
from roboglot.autonomy.delivery.order_book import OrderBook
from roboglot.autonomy.delivery.rules import BOXED, check_requests
from roboglot.model.components.logistics.delivery import (
    Delivery,
    Order,
    OrderKind,
    OrderRequest,
    OrderStage,
    OrderStatus,
    Phase,
    Policy,
)
from roboglot.model.errors import Refused
from roboglot.model.events import DeliveryNews
from roboglot.model.robot import Robot


class QueueDelivery(Delivery):
    """Delivery with a queue; inactive before the first order."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._book = OrderBook(robot)
        self._driver, self._signals = DeliveryDrive(robot), Signals(robot)
        self._driver.hold(self._book.held)
        self._courier = Courier(robot, self._book, self._driver, self._signals)

    def start(self) -> None:
        """Resume the orders in the book."""
        self._courier.readiness.start()
        if self._book.open:
            self._courier.wake()

    def close(self) -> None:
        """Stop working; the book stays as it is."""
        self._courier.close()

    @property
    def orders(self) -> Sequence[Order]:
        return self._book.orders

    @property
    def current(self) -> Order | None:
        return self._book.get(self._courier.current) if self._courier.current else None

    @property
    def phase(self) -> Phase:
        return self._courier.phase

    @property
    def policy(self) -> Policy:
        return self._book.policy

    async def change_policy(self, edit: Callable[[Policy], Policy]) -> None:
        await self._book.change_policy(edit)
        self._driver.report(DeliveryNews.SETTINGS_CHANGED)
        if self._courier.delivers:
            self._courier.wake()

    async def accept(self, *requests: OrderRequest) -> Sequence[Order]:
        async with self._courier.changing:
            check_requests(self._robot, self.policy, requests, self._book.open)
            level = self._courier.readiness.level
            if any(request.kind in BOXED for request in requests) and level <= self.policy.level_no_takeout:
                raise Refused("the battery is too low for takeouts")
            if any(request.remote for request in requests) and level <= self.policy.level_no_cloud:
                raise Refused("the battery is too low for remote orders")
            known = {order.number for order in self._book.orders}
            if any(request.number in known for request in requests if request.number):
                raise Refused("there is already an order with that number")
            orders = await self._book.add(requests)
        if any(request.remote for request in requests):
            self._driver.report(DeliveryNews.ORDER_RECEIVED)
        self._courier.wake()
        return orders

    async def cancel(self, id: str | None = None) -> None:
        async with self._courier.changing:
            doomed = [self._book.get(id)] if id is not None else self._book.open
            for order in doomed:
                await self._courier.call_off(order)

    async def disown(self, owner: str) -> None:
        await self._courier.disown(owner)

    async def finish(self) -> None:
        async with self._courier.changing:
            await self._book.end_all(status=OrderStatus.SUCCEEDED)
            self._courier.drop_current()

    @property
    def executing(self) -> bool:
        return self._driver.allowed

    async def execute(self, on: bool) -> None:
        await self._book.hold(not on)
        if on and not self.executing:
            self._courier.readiness.rest_due = True
        self._driver.hold(not on)
        self._courier.wake()

    def halt(self) -> bool:
        if not self.executing or not self._book.open:
            return False
        self._driver.hold(True)
        return True

    async def start_pickup(self) -> None:
        order = self.current
        if order and order.stage is OrderStage.HANDING_OVER:
            return
        if order and order.stage is OrderStage.AT_TARGET and order.request.kind in (OrderKind.FOOD, OrderKind.RECYCLE):
            return
        self._signals.receive(Signal.START)

    async def end_pickup(self) -> None:
        self._signals.receive(Signal.END)

    async def end_operation(self) -> None:
        self._signals.receive(Signal.OPERATION_DONE)
