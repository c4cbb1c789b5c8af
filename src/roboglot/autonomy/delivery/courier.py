"""Carries out a robot's orders, one after the other, and drives it to its resting place when idle."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine

from roboglot.autonomy.delivery.delivery_round import Round
from roboglot.autonomy.delivery.drive import DeliveryDrive, Failed
from roboglot.autonomy.delivery.follow_up import follow_up
from roboglot.autonomy.delivery.handover import Signals
from roboglot.autonomy.delivery.order_book import OrderBook
from roboglot.autonomy.delivery.readiness import Readiness
from roboglot.autonomy.delivery.rules import PARKING, place_of_type
from roboglot.model.admission import Right
from roboglot.model.client_context import client, set_client
from roboglot.model.components.logistics.delivery import Failure, Order, OrderKind, OrderStatus, Phase, Policy
from roboglot.model.components.mapping.map_memory import settle
from roboglot.model.components.motion.driving import BASE
from roboglot.model.errors import RobotError
from roboglot.model.events import DeliveryNews
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
HOURS_LOOK = 10.0  # s between two checks of the opening hours while idle
STORE_RETRY = 5.0  # s until it tries again to store how an order begins or ends
BASE_LOOK = 1.0  # s between two checks whether another client still drives the robot


class Courier:
    """Worker on the book from the first ``wake`` to ``close``. ``changing``: held to add or cancel orders."""

    def __init__(self, robot: Robot, book: OrderBook, driver: DeliveryDrive, signals: Signals) -> None:
        self._robot, self._book, self._driver, self._signals = robot, book, driver, signals
        self.changing = asyncio.Lock()
        self.readiness = Readiness(robot, self, driver.report)
        self.phase = Phase.IDLE
        self.current: str | None = None
        self._woken = asyncio.Event()
        self._job: asyncio.Task[None] | None = None
        self._worker: asyncio.Task[None] | None = None
        self._giving_up: asyncio.Task[None] | None = None

    def close(self) -> None:
        """Stop working; the book stays as it is."""
        self.readiness.close()
        for task in (self._worker, self._job, self._giving_up):
            if task:
                task.cancel()

    @property
    def policy(self) -> Policy:
        """The rules of delivery."""
        return self._book.policy

    @property
    def delivers(self) -> bool:
        """True once there has been an order."""
        return self._worker is not None

    def wake(self) -> None:
        """Check for orders to begin."""
        self._woken.set()
        if self._worker is None:
            self._worker = asyncio.get_running_loop().create_task(self._work(), name=f"{self._robot.id} delivers")
        if self.phase in (Phase.RETURNING, Phase.GOING_HOME) and self._next():
            self._stop_job()

    async def call_off(self, order: Order, failure: Failure | None = None) -> None:
        """Cancel an open order; ``failure``: its reason, if any."""
        if order.status.ended or order.status is OrderStatus.CANCELING:
            return
        running = order.id == self.current
        status = OrderStatus.CANCELING if running else OrderStatus.CANCELED
        await self._book.change(order.id, status=status, failure=failure)
        if running:
            self._stop_job()

    async def disown(self, owner: str) -> None:
        """Cancel the open orders of a client that may no longer drive, and stand still unless others have orders."""
        async with self.changing:
            for order in [order for order in self._book.open if order.owner == owner]:
                await self.call_off(order, Failure.REFUSED)
                self.readiness.rest_due = False

    def drop_current(self) -> None:
        """Stop the order under way, whose end is in the book already."""
        if self.current:
            self._stop_job()

    def give_up(self) -> None:
        """Cancel all orders: the battery is low."""
        self._giving_up = asyncio.get_running_loop().create_task(self._give_up(), name=f"{self._robot.id} battery low")

    async def _give_up(self) -> None:
        async with self.changing:
            for order in self._book.open:
                await self.call_off(order, Failure.BATTERY_LOW)
        if self.phase is Phase.RETURNING:
            self._stop_job()
        self.wake()

    def _stop_job(self) -> None:
        if self._job:
            self._job.cancel()

    def _next(self) -> Order | None:
        """Return the order to begin now; None: there is none, or no order may begin."""
        if not self._driver.allowed or not self.readiness.works:
            return None
        return next((order for order in self._book.open if order.status is OrderStatus.READY), None)

    @property
    def _may_rest(self) -> bool:
        readiness = self.readiness
        return readiness.rest_due and self._driver.allowed and not readiness.lost and readiness.awake

    async def _work(self) -> None:
        while True:
            self._woken.clear()
            self.readiness.look_at_hours()
            if order := self._next():
                if self._robot.actions.running(BASE):
                    await self._robot.clock.sleep(BASE_LOOK)  # the current driver may finish
                    continue
                try:
                    await self._carry_out(order)
                except RobotError as error:  # the database's
                    await self._wait_for_room(order, error)
            elif self._may_rest:
                await self._rest()
            else:
                await self._wait()

    async def _wait(self) -> None:
        if not self._book.policy.hours and not self._book.policy.rest_days:
            await self._woken.wait()
            return
        try:
            await self._robot.clock.wait_for(self._woken.wait(), HOURS_LOOK)
        except TimeoutError:
            return

    async def _carry_out(self, order: Order) -> None:
        set_client(order.client, identity=order.owner)
        if order.owner and not self._robot.admission.may(Right.DRIVE):  # lost while the program was down
            await self.call_off(order, Failure.REFUSED)
            return
        began = order.began_at or self._robot.clock.epoch()
        order = await self._book.change(order.id, status=OrderStatus.RUNNING, began_at=began)
        self.current, self.phase, self.readiness.rest_due = order.id, Phase.WORKING, True
        station = order.request.kind is OrderKind.STATION
        self._driver.report(DeliveryNews.STATION_STARTED if station else DeliveryNews.ORDER_STARTED)
        failure: Failure | None = None
        try:
            if await self._do(Round(self._robot, self._book, self._driver, self._signals, order).run()):
                status = OrderStatus.SUCCEEDED
            else:
                status = OrderStatus.CANCELED
        except Failed as error:
            status, failure = OrderStatus.FAILED, error.failure
        except RobotError as error:
            log.info("robot %s: order %s failed: %s", self._robot.id, order.number, error)
            status, failure = OrderStatus.FAILED, Failure.REFUSED
        self.phase, self.current = Phase.IDLE, None
        order = await self._end(order.id, status, failure)
        if order.status is OrderStatus.FAILED:
            await follow_up(self._robot, self._book, self._driver, self.readiness, order)

    async def _end(self, id: str, status: OrderStatus, failure: Failure | None) -> Order:
        """Store how an order ended, and return it; while that cannot be stored, no other order begins."""
        while True:
            order = self._book.get(id)
            if order.status.ended:
                return order
            if order.status is OrderStatus.CANCELING:
                status, failure = OrderStatus.CANCELED, order.failure
            try:
                return await self._book.change(id, status=status, failure=failure or order.failure)
            except RobotError as error:
                await self._wait_for_room(order, error)

    async def _wait_for_room(self, order: Order, error: RobotError) -> None:
        log.warning("robot %s: cannot store order %s: %s", self._robot.id, order.number, error)
        await self._robot.clock.sleep(STORE_RETRY)

    async def _do(self, work: Coroutine[None, None, None]) -> bool:
        """Run ``work`` as a task that may be cancelled; return False if it was."""
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
        """Drive to the parking place, or onto the dock off work and with a low battery."""
        set_client(client())  # the robot's own decision: the last order's client may have lost its right
        robot, readiness = self._robot, self.readiness
        readiness.rest_due = False
        docked = readiness.docked
        await settle(robot)
        parking = place_of_type(robot, PARKING) if readiness.parks else None
        try:
            if parking:
                self.phase = Phase.RETURNING
                await self._do(self._driver.go(parking, self._book.policy, self._book.policy.return_speed))
            elif not docked and readiness.has_home:
                self.phase = Phase.GOING_HOME
                await self._do(self._driver.go_home(self._book.policy))
        except Failed as error:
            log.info("robot %s cannot drive to its resting place: %s", robot.id, error)
            if error.failure is Failure.NOT_LOCALIZED:
                readiness.lose()
        finally:
            self.phase = Phase.IDLE
