"""Valid orders by the thousand over two brokers, mosquitto and amqtt: each is taken or refused in the standard's words.

amqtt pins another version of websockets than roboglot has, so it lives in an environment of its own: scripts/amqtt
makes it.
"""

from __future__ import annotations

import asyncio
import os
import subprocess
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.model.tap import Direction, Exchange
from roboglot.testing.addresses import free_port
from roboglot.wire.vda5050.versions import ErrorKind
from tests.protocols.vda5050.conftest import ADDRESS, MOSQUITTO, PATIENCE, Opened, Yard, listening
from tests.protocols.vda5050.orders import action, instant, valid_orders

AMQTT = Path(__file__).parents[3] / "build" / "amqtt" / "bin" / "amqtt"
ORDERS = int(os.environ.get("ROBOGLOT_ORDERS", "10000"))
BATCH = 50


@pytest.fixture(params=["mosquitto", "amqtt"])
def any_broker(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """The port of one broker of each kind."""
    port = free_port()
    folder = tmp_path_factory.mktemp(request.param)
    if request.param == "mosquitto":
        if MOSQUITTO is None:
            pytest.skip("needs mosquitto: apt-get install mosquitto")
        (folder / "conf").write_text(f"listener {port} {ADDRESS}\nallow_anonymous true\n")
        command = [MOSQUITTO, "-c", str(folder / "conf")]
    else:
        if not AMQTT.exists():
            pytest.skip("needs amqtt: scripts/amqtt")
        (folder / "conf.yaml").write_text(
            f"listeners:\n  default:\n    type: tcp\n    bind: {ADDRESS}:{port}\n"
            "plugins:\n  amqtt.plugins.authentication.AnonymousAuthPlugin:\n    allow_anonymous: true\n"
        )
        command = [str(AMQTT), "-c", str(folder / "conf.yaml")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        listening(port)
        yield port
        process.terminate()


@pytest.mark.slow  # ten thousand orders; test_order_book.py reads fewer
@pytest.mark.timeout(600)
async def test_ten_thousand_valid_orders_each_get_their_answer(any_broker: int, yard: Opened) -> None:
    orders = _orders(ORDERS)  # before the robot connects: brokers drop silent clients after a while
    one = await yard(port=any_broker)
    outcomes: Counter[str] = Counter()

    def count(seen: Exchange) -> None:
        if seen.direction is Direction.REPLY and seen.operation == "order":
            outcomes[seen.status] += 1

    one.robot.tap.listen(count)
    for start in range(0, len(orders), BATCH):
        batch, before = orders[start : start + BATCH], outcomes["accepted"]
        for number, made in enumerate(batch, start):
            one.control.send("order", made | {"orderId": f"{number}"}, wait=False)
        async with asyncio.timeout(PATIENCE):
            while outcomes.total() < start + len(batch):  # noqa: ASYNC110
                await asyncio.sleep(0.002)
        if outcomes["accepted"] > before:
            await _clear(one, start)
    assert outcomes.total() == len(orders)
    assert outcomes["accepted"] > len(orders) / 1000
    assert outcomes.keys() - {"accepted"} <= {kind.value for kind in ErrorKind}
    assert ErrorKind.MALFORMED.value not in outcomes


async def _clear(one: Yard, number: int) -> None:
    """Have the order cancelled that was taken, if it goes on."""
    one.control.send("instantActions", instant(action("cancelOrder", f"c{number}")))
    ended = ("FINISHED", "FAILED")
    await one.until(
        lambda: any(
            state["actionId"] == f"c{number}" and state["actionStatus"] in ended
            for state in one.control.state["instantActionStates"]
        )
    )
    one.control.heard = {name: heard[-1:] for name, heard in one.control.heard.items()}


def _orders(count: int) -> list[dict[str, object]]:
    """That many random orders; their number, and so the sample, is always the same."""
    made: list[dict[str, Any]] = []

    @settings(max_examples=count // 10 + 1, database=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(st.lists(valid_orders(), min_size=10, max_size=10))
    def collect(orders: list[dict[str, Any]]) -> None:
        made.extend(orders)

    while len(made) < count:
        collect()
    for order in made[::3]:  # the others start too far away
        order["nodes"][0]["nodePosition"] |= {"x": 0.0, "y": 0.0, "allowedDeviationXY": 2.0}
    return made[:count]
