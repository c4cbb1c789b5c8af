"""The delivery service: takes orders, carries out one after the other, and goes to rest. Made of other skills."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Sequence

from roboglot.autonomy.delivery.delivery_round import Round
from roboglot.autonomy.delivery.drive import Driver, Failed
from roboglot.autonomy.delivery.follow_up import follow_up
from roboglot.autonomy.delivery.handover import Ears, Signal
from roboglot.autonomy.delivery.order_book import OrderBook
from roboglot.autonomy.delivery.readiness import Readiness
from roboglot.autonomy.delivery.rules import BOXED, PARKING, check_requests, place_of_type
from roboglot.model.components.logistics.delivery import (
    Delivery,
    Failure,
    Order,
    OrderKind,
    OrderRequest,
    OrderStage,
    OrderStatus,
    Phase,
    Policy,
)
from roboglot.model.components.motion.driving import BASE
from roboglot.model.errors import Refused, RobotError
from roboglot.model.events import DeliveryNews
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
HOURS_LOOK = 10.0  # s between looks at the clock while there is nothing to do
BASE_LOOK = 1.0  # s between looks whether another client still drives the robot


class QueueDelivery(Delivery):
    """Touches nothing before the first order: robots that never deliver notice nothing of it."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._book = OrderBook(robot)
        self._driver, self._ears = Driver(robot), Ears(robot)
        self._driver.hold(self._book.held)
        self._lock = asyncio.Lock()
        self._woken = asyncio.Event()
        self._phase = Phase.IDLE
        self._current: str | None = None
        self._job: asyncio.Task[None] | None = None
        self._worker: asyncio.Task[None] | None = None
        self._giving_up: asyncio.Task[None] | None = None
        self._readiness = Readiness(robot, self, self._driver.report)

    def start(self) -> None:
        """Go on with what is in the book."""
        self._readiness.start()
        if self._book.open:
            self.wake()

    def close(self) -> None:
        """Leave the book as it is."""
        self._readiness.close()
        for task in (self._worker, self._job, self._giving_up):
            if task:
                task.cancel()

    @property
    def orders(self) -> Sequence[Order]:
        return self._book.orders

    @property
    def current(self) -> Order | None:
        return self._book.get(self._current) if self._current else None

    @property
    def phase(self) -> Phase:
        return self._phase

    @property
    def policy(self) -> Policy:
        return self._book.policy

    async def set_policy(self, policy: Policy) -> None:
        await self._book.set_policy(policy)
        self._driver.report(DeliveryNews.SETTINGS_CHANGED)
        if self._worker:
            self.wake()

    async def accept(self, *requests: OrderRequest) -> Sequence[Order]:
        async with self._lock:
            check_requests(self._robot, self.policy, requests, self._book.open)
            if (
                any(request.kind in BOXED for request in requests)
                and self._readiness.level <= self.policy.level_no_takeout
            ):
                raise Refused("the battery is too low for takeouts")
            if any(request.remote for request in requests) and self._readiness.level <= self.policy.level_no_cloud:
                raise Refused("the battery is too low for orders from afar")
            known = {order.number for order in self._book.orders}
            if any(request.number in known for request in requests if request.number):
                raise Refused("there is an order of that number already")
            orders = await self._book.add(requests)
        if any(request.remote for request in requests):
            self._driver.report(DeliveryNews.ORDER_RECEIVED)
        self.wake()
        return orders

    async def cancel(self, id: str | None = None) -> None:
        async with self._lock:
            doomed = [self._book.get(id)] if id is not None else self._book.open
            for order in doomed:
                await self._cancel(order, None)

    async def finish(self) -> None:
        async with self._lock:
            await self._book.end_all(OrderStatus.SUCCEEDED)
            if self._current and self._job:
                self._job.cancel()

    @property
    def executing(self) -> bool:
        return self._driver.allowed

    async def execute(self, on: bool) -> None:
        await self._book.hold(not on)
        if on and not self.executing:
            self._readiness.rest_due = True
        self._driver.hold(not on)
        self.wake()

    async def start_pickup(self) -> None:
        order = self.current
        if order and order.stage is OrderStage.HANDING_OVER:
            return
        if order and order.stage is OrderStage.AT_TARGET and order.request.kind in (OrderKind.FOOD, OrderKind.RECYCLE):
            return
        self._ears.receive(Signal.START)

    async def end_pickup(self) -> None:
        self._ears.receive(Signal.END)

    async def end_operation(self) -> None:
        self._ears.receive(Signal.OPERATION_DONE)

    # ------------------------------------------------------------------------------------------------------------------

    async def _cancel(self, order: Order, failure: Failure | None) -> None:
        if order.status.ended or order.status is OrderStatus.CANCELING:
            return
        running = order.id == self._current
        status = OrderStatus.CANCELING if running else OrderStatus.CANCELED
        await self._book.change(order.id, status=status, failure=failure)
        if running and self._job:
            self._job.cancel()

    @property
    def delivers(self) -> bool:
        """Whether there ever was an order."""
        return self._worker is not None

    def wake(self) -> None:
        """Look again at what is to be done."""
        self._woken.set()
        if self._worker is None:
            self._worker = asyncio.get_running_loop().create_task(self._work(), name=f"{self._robot.id} delivers")
        if self._phase in (Phase.RETURNING, Phase.GOING_HOME) and self._next() and self._job:
            self._job.cancel()

    def _next(self) -> Order | None:
        """The order to begin now."""
        if not self.executing or not self._readiness.works:
            return None
        return next((order for order in self._book.open if order.status is OrderStatus.READY), None)

    async def _work(self) -> None:
        while True:
            self._woken.clear()
            self._readiness.look_at_hours()
            if order := self._next():
                if self._robot.actions.running(BASE):
                    await self._robot.clock.sleep(BASE_LOOK)  # the current driver may finish
                    continue
                await self._carry_out(order)
            elif self._readiness.rest_due and self.executing and not self._readiness.lost:
                await self._rest()
            else:
                await self._wait()

    async def _wait(self) -> None:
        if not self.policy.hours and not self.policy.rest_days:
            await self._woken.wait()
            return
        try:
            await self._robot.clock.wait_for(self._woken.wait(), HOURS_LOOK)
        except TimeoutError:
            return

    async def _carry_out(self, order: Order) -> None:
        began = order.began_at or self._robot.clock.epoch()
        order = await self._book.change(order.id, status=OrderStatus.RUNNING, began_at=began)
        self._current, self._phase, self._readiness.rest_due = order.id, Phase.WORKING, True
        station = order.request.kind is OrderKind.STATION
        self._driver.report(DeliveryNews.STATION_STARTED if station else DeliveryNews.ORDER_STARTED)
        failure: Failure | None = None
        try:
            if await self._do(Round(self._robot, self._book, self._driver, self._ears, order).run()):
                status = OrderStatus.SUCCEEDED
            else:
                status = OrderStatus.CANCELED
        except Failed as error:
            status, failure = OrderStatus.FAILED, error.failure
        except RobotError as error:
            log.info("robot %s: order %s failed: %s", self._robot.id, order.number, error)
            status, failure = OrderStatus.FAILED, Failure.REFUSED
        self._phase, self._current = Phase.IDLE, None
        order = self._book.get(order.id)
        if not order.status.ended:
            order = await self._book.change(order.id, status=status, failure=failure or order.failure)
        if status is OrderStatus.FAILED:
            await follow_up(self._robot, self._book, self._driver, self._readiness, order)

    async def _do(self, work: Coroutine[None, None, None]) -> bool:
        """Do it as a task that others may cancel; False if they did."""
        self._job = job = asyncio.get_running_loop().create_task(work, name=f"{self._robot.id} delivery job")
        try:
            await asyncio.wait({job})
        finally:
            job.cancel()
            self._job = None
        if job.cancelled():
            return False
        job.result()
        return True

    async def _rest(self) -> None:
        """To the parking place, or onto the dock; there at once off work and with a low battery."""
        robot, readiness = self._robot, self._readiness
        readiness.rest_due = False
        docked = readiness.docked
        parking = place_of_type(robot, PARKING) if readiness.parks else None
        try:
            if parking:
                self._phase = Phase.RETURNING
                await self._do(self._driver.go(parking, self.policy, self.policy.return_speed))
            elif not docked and readiness.has_home:
                self._phase = Phase.GOING_HOME
                await self._do(self._driver.go_home(self.policy))
        except Failed as error:
            log.info("robot %s could not go to rest: %s", robot.id, error)
            if error.failure is Failure.NOT_LOCALIZED:
                readiness.lose()
        finally:
            self._phase = Phase.IDLE

    def give_up(self) -> None:
        """Cancel all orders: the battery is low."""
        self._giving_up = asyncio.get_running_loop().create_task(self._give_up(), name=f"{self._robot.id} battery low")

    async def _give_up(self) -> None:
        async with self._lock:
            for order in self._book.open:
                await self._cancel(order, Failure.BATTERY_LOW)
        if self._phase is Phase.RETURNING and self._job:
            self._job.cancel()
        self.wake()
