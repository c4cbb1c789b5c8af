"""The delivery service's orders and policy: read from memory, stored in the robot's ledger and settings."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypedDict, Unpack

import msgspec

from roboglot.model.client_context import client, identity
from roboglot.model.components.logistics.delivery import (
    Failure,
    Order,
    OrderRequest,
    OrderStage,
    OrderStatus,
    PickUp,
    Policy,
    Untaken,
)
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import NotFound, Refused
from roboglot.model.robot import Robot

KIND, POLICY, HOLD = "order", "delivery.policy", "delivery.hold"
OPEN_MAX, ENDED_MAX = 100, 100  # orders


class OrderChanges(TypedDict, total=False):
    """Fields of an order that may change."""

    request: OrderRequest
    status: OrderStatus
    stage: OrderStage
    stop: str
    failure: Failure | None
    results: tuple[PickUp, ...]
    untaken: tuple[Untaken, ...]
    began_at: float


class OrderBook:
    """Book of orders; every change is on disk before the call returns."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._ledger, self._settings = robot[Ledger], robot[Settings]
        self._orders = {id: _revived(document) for id, document in self._ledger.all(KIND)}
        self.policy = msgspec.convert(self._settings.get(POLICY, {}), Policy)
        self._turn = asyncio.Lock()  # of changes: each begins with what the one before left

    @property
    def orders(self) -> Sequence[Order]:
        """All orders, oldest first."""
        return tuple(self._orders.values())

    @property
    def open(self) -> list[Order]:
        """Orders that have not ended, oldest first."""
        return [order for order in self._orders.values() if not order.status.ended]

    def get(self, id: str) -> Order:
        """Return an order by its id or number. Raises NotFound."""
        for order in self._orders.values():
            if id in (order.id, order.number):
                return order
        raise NotFound(f"there is no order {id}")

    async def add(self, requests: Sequence[OrderRequest]) -> Sequence[Order]:
        """Queue orders. Raises Refused if the queue is full."""
        if len(self.open) + len(requests) > OPEN_MAX:
            raise Refused(f"more than {OPEN_MAX} orders")
        now = self._robot.clock.epoch()
        orders = [
            Order(
                id=str(uuid.uuid4()),
                number=request.number or uuid.uuid4().hex,
                request=request,
                stage=OrderStage.DRIVING_TO_STOP if request.stops else OrderStage.DRIVING,
                changed_at=now,
                client=client(),
                owner=identity(),
            )
            for request in requests
        ]
        async with self._turn:
            await self._write(*orders)
        return orders

    async def change(self, id: str, **changes: Unpack[OrderChanges]) -> Order:
        """Change an order; return it once it is safe on disk."""
        async with self._turn:
            order = replace(self._orders[id], changed_at=self._robot.clock.epoch(), **changes)
            await self._write(order)
        return order

    async def end_all(self, **changes: Unpack[OrderChanges]) -> None:
        """End all open orders in one transaction; ``changes``: their new status."""
        now = self._robot.clock.epoch()
        async with self._turn:
            await self._write(*(replace(order, changed_at=now, **changes) for order in self.open))

    async def change_policy(self, edit: Callable[[Policy], Policy]) -> None:
        """Replace the policy by ``edit`` of it; return once it is safe on disk."""
        async with self._turn:
            policy = edit(self.policy)
            await self._settings.put(POLICY, msgspec.to_builtins(policy))
            self.policy = policy

    @property
    def held(self) -> bool:
        """True if the last ``hold`` put the robot on hold."""
        return bool(self._settings.get(HOLD, False))

    async def hold(self, held: bool) -> None:
        """Store whether the robot is on hold; return once it is safe on disk."""
        await self._settings.put(HOLD, held)

    async def _write(self, *orders: Order) -> None:
        documents = {order.id: msgspec.to_builtins(order) for order in orders}
        ended = [order.id for order in self._orders.values() if order.status.ended and order.id not in documents]
        surplus = ended[: max(0, len(ended) - ENDED_MAX)]
        await self._ledger.write(KIND, documents, forget=surplus)
        self._orders |= {order.id: order for order in orders}
        for id in surplus:
            self._orders.pop(id, None)


def _revived(document: object) -> Order:
    """Return a stored order as it continues after a restart."""
    order = msgspec.convert(document, Order)
    if order.status is OrderStatus.RUNNING:
        return replace(order, status=OrderStatus.READY)
    return replace(order, status=OrderStatus.CANCELED) if order.status is OrderStatus.CANCELING else order
