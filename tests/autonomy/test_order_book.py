"""The delivery service's book: changes that come while others are being written count one by one."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

from roboglot.autonomy.delivery.order_book import OrderBook
from roboglot.model.clock import LockstepClock
from roboglot.model.components.logistics.delivery import OrderKind, OrderRequest, OrderStatus
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Description, Robot
from roboglot.storage.database import Database
from roboglot.storage.ledger import StoredLedger
from roboglot.storage.settings import StoredSettings

PLATE = Description(
    maker="x", model="x", serial="1", hardware_version="1", software_version="1", radius=0.2, height=0.3
)


def book_of(database: Database) -> OrderBook:
    robot = Robot("a", PLATE, LockstepClock())
    robot.add(Ledger, StoredLedger(database, "a"))
    robot.add(Settings, StoredSettings(database, "a"))
    return OrderBook(robot)


async def test_changes_at_once_all_count(tmp_path: Path) -> None:
    database = Database(tmp_path / "a.db")
    book = book_of(database)
    (order,) = await book.add([OrderRequest(OrderKind.RETURN, "r")])
    await asyncio.gather(
        book.change(order.id, status=OrderStatus.CANCELING),
        book.change(order.id, stop="r"),
        book.change_policy(lambda policy: replace(policy, delivery_speed=0.5)),
        book.change_policy(lambda policy: replace(policy, return_speed=0.4)),
    )
    for found in (book, book_of(database)):  # in memory, and on disk
        assert (found.get(order.id).stop, found.policy.delivery_speed, found.policy.return_speed) == ("r", 0.5, 0.4)
    assert book.get(order.id).status is OrderStatus.CANCELING
    database.close()
