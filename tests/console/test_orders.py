"""Orders of a delivering robot at the console: shown with their progress, held by a stop, cancelled."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.model.components.logistics.delivery import Delivery, OrderKind, OrderRequest, OrderStatus
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.base import Base
from roboglot.model.components.system.lease import Lease
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from tests.console.conftest import ServedConsole


async def shown(served: ServedConsole) -> dict[str, object]:
    _, state = await served.ask("/api/robots/a")
    orders: dict[str, object] = state["orders"]
    return orders


async def order(robot: Robot, *kinds: OrderKind) -> list[str]:
    await robot[Places].put(PointOfInterest("r", Pose(2.0, 0.0), {"display_name": "room"}))
    return [order.id for order in await robot[Delivery].accept(*(OrderRequest(kind, "room") for kind in kinds))]


def status_of(robot: Robot, id: str) -> OrderStatus:
    return next(order.status for order in robot[Delivery].orders if order.id == id)


async def test_orders_are_shown_until_they_ended(served: ServedConsole) -> None:
    food, later = await order(served.robot, OrderKind.FOOD, OrderKind.GUIDE)
    await served.clock.advance(3.0)
    assert await shown(served) == {
        "held": "",
        "more": 0,
        "list": [
            {
                "id": food,
                "task": "serve food at room",
                "status": "EXECUTING",
                "open": True,
                "doing": "on the way to room",
                "client": "",
                "reason": "",
            },
            {
                "id": later,
                "task": "guide someone to room",
                "status": "waiting",
                "open": True,
                "doing": "",
                "client": "",
                "reason": "",
            },
        ],
    }
    await served.clock.advance(20.0)
    first = (await shown(served))["list"][0]  # type: ignore[index]
    assert (first["status"], first["doing"]) == ("EXECUTING", "waits for people at room")
    assert (await served.ask("/api/robots/a/cancel_order", {"order": later}))[0] == 200
    await served.clock.advance(120.0)
    ended = [(entry["status"], entry["reason"]) for entry in (await shown(served))["list"]]  # type: ignore[attr-defined]
    assert ended == [("CANCELED", ""), ("ABORTED", "nobody took it")]


@pytest.mark.parametrize("waiting", [False, True])
async def test_a_stopped_robot_begins_no_order(served: ServedConsole, waiting: bool) -> None:
    """The next order began 0.1 s after the stop, as did the drive home."""
    robot, clock = served.robot, served.clock
    first, second = await order(robot, OrderKind.FOOD, OrderKind.RETURN)
    await clock.advance(20.0 if waiting else 4.0)
    assert (robot[Base].velocity.x > 0.1) is not waiting
    stopping = asyncio.create_task(served.ask("/api/robots/a/stop", {}))
    while not stopping.done():
        await clock.advance(0.1)
    assert (await stopping)[0] == 200
    for _ in range(40):
        await clock.advance(5.0)
        assert abs(robot[Base].velocity.x) < 0.02
    assert status_of(robot, second) is OrderStatus.READY
    assert status_of(robot, first) is OrderStatus.FAILED
    assert "wait" in str((await shown(served))["held"])
    assert (await served.ask("/api/robots/a/resume_orders", {}))[0] == 200
    await clock.advance(20.0)
    assert status_of(robot, second) is OrderStatus.SUCCEEDED
    assert (await shown(served))["held"] == ""


async def test_orders_wait_while_control_is_taken(served: ServedConsole) -> None:
    """All orders failed within a second."""
    robot, clock = served.robot, served.clock
    await robot[Lease].take("console anna")
    (guide,) = await order(robot, OrderKind.GUIDE)
    await clock.advance(20.0)
    assert status_of(robot, guide) is OrderStatus.RUNNING
    await robot[Lease].release()
    await clock.advance(20.0)
    assert status_of(robot, guide) is OrderStatus.SUCCEEDED


async def test_stop_on_a_full_disk_stands_and_holds(served: ServedConsole) -> None:
    await order(served.robot, OrderKind.FOOD, OrderKind.RETURN)
    await served.clock.advance(20.0)
    assert served.runtime.fleet.world is not None
    served.runtime.fleet.world.faults.inject("full_disk", "a")
    status, answer = await served.ask("/api/robots/a/stop", {})
    assert (status, answer["error"]) == (
        409,
        "it stands, but its orders are held only until a restart: the disk is full",
    )
    assert not served.robot[Delivery].executing
