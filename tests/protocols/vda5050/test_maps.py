"""The maps that the robot keeps, as fleet control sees, enables and deletes them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from tests.protocols.vda5050.conftest import Opened, Yard
from tests.protocols.vda5050.orders import action, instant, order
from tests.protocols.vda5050.test_actions import robot_at, states


def listed(yard: Yard) -> dict[str, str]:
    """Status of the maps in the state."""
    return {one["mapId"]: one["mapStatus"] for one in yard.control.state["maps"]}


async def keeping(yard: Yard, name: str, *, known: bool = True) -> None:
    """Keep the map in use under a name, or one in which there is nothing of where the robot is."""
    await yard.until(lambda: yard.robot[Mapping].grid.width > 0 and yard.robot[Localization].lost is None)
    grid = yard.robot[Mapping].grid
    cells = grid.log_odds.copy() if known else np.full((60, 60), -20, dtype=np.int8)
    made = OccupancyGrid(cells, grid.resolution, grid.origin if known else Point(0.0, 0.0))
    await yard.robot[MapLibrary].put(StoredMap(name, made, 1.0))
    await yard.until(lambda: name in listed(yard))


async def asked(yard: Yard, kind: str, id: str, **parameters: Any) -> tuple[str, str]:
    """Return how an instant action ended."""
    yard.control.send("instantActions", instant(action(kind, id, **parameters)))
    await yard.until(lambda: states(yard).get(id, ("", ""))[0] in ("FINISHED", "FAILED"))
    return states(yard)[id]


async def test_kept_map_is_enabled_and_orders_name_it(yard: Opened) -> None:
    one = await yard(**robot_at(5.0, 5.0))
    assert listed(one) == {"map": "ENABLED"}
    await keeping(one, "office")
    assert listed(one) == {"map": "ENABLED", "office": "DISABLED"}
    assert await asked(one, "enableMap", "1", mapId="office", mapVersion="") == ("FINISHED", "")
    assert listed(one) == {"office": "ENABLED"}
    assert one.control.state["mobileRobotPosition"]["mapId"] == "office"
    one.control.send("order", order("old", [(0, 0), (0.5, 0)]))
    await one.until(lambda: "UNKNOWN_MAP_ID" in one.control.errors)
    driven = order("new", [(0, 0), (0.5, 0)])
    for node in driven["nodes"]:
        node["nodePosition"]["mapId"] = "office"
    one.control.send("order", driven)
    await one.until(lambda: one.control.state["orderId"] == "new" and one.control.state["nodeStates"] == [])
    assert one.control.state["lastNodeId"] == "n1"
    assert one.control.state["distanceSinceLastNode"] < 0.2


async def test_each_floor_has_a_map_id(yard: Opened) -> None:
    """Places of one floor are none of another."""
    one = await yard(world="office")
    await one.until(lambda: listed(one) == {"map": "ENABLED"})
    one.robot[Floors].begin_on(1)  # as a client's ride, or one that says where the robot was carried
    await one.until(lambda: listed(one) == {"map-1": "ENABLED"})
    assert one.control.state["mobileRobotPosition"]["mapId"] == "map-1"
    one.control.send("order", order("old", [(0, 0), (0.5, 0)]))
    await one.until(lambda: "UNKNOWN_MAP_ID" in one.control.errors)


async def test_unusable_or_undeletable_maps_are_refused(yard: Opened) -> None:
    one = await yard(**robot_at(5.0, 5.0))
    await keeping(one, "office")
    assert (await asked(one, "enableMap", "1", mapId="nowhere"))[0] == "FAILED"
    assert (await asked(one, "enableMap", "2", mapId="office", mapVersion="7"))[0] == "FAILED"
    assert (await asked(one, "deleteMap", "3", mapId="map"))[0] == "FAILED"
    assert "INVALID_INSTANT_ACTION" in one.control.errors
    assert listed(one) == {"map": "ENABLED", "office": "DISABLED"}
    assert (await asked(one, "deleteMap", "4", mapId="office", mapVersion=""))[0] == "FINISHED"
    await one.until(lambda: listed(one) == {"map": "ENABLED"})
    assert list(await one.robot[MapLibrary].names()) == []


async def test_no_map_is_changed_under_an_order(yard: Opened) -> None:
    one = await yard(**robot_at(5.0, 5.0))
    await keeping(one, "office")
    one.control.send("order", order("way", [(0, 0), (0.4, 0)], released=1))
    await one.until(lambda: one.control.state["orderId"] == "way")
    status, why = await asked(one, "enableMap", "1", mapId="office")
    assert (status, why) == ("FAILED", "order way is being driven in 'map'")


@pytest.mark.slow
async def test_map_without_the_robot_is_not_used(yard: Opened) -> None:
    one = await yard(**robot_at(5.0, 5.0))
    await keeping(one, "elsewhere", known=False)
    before = one.robot[Mapping].grid.width
    assert (await asked(one, "enableMap", "1", mapId="elsewhere"))[0] == "FAILED"
    assert listed(one) == {"map": "ENABLED", "elsewhere": "DISABLED"}
    assert abs(one.robot[Mapping].grid.width - before) <= 2


async def test_map_loaded_by_another_loses_the_old_name(yard: Opened) -> None:
    one = await yard(**robot_at(5.0, 5.0))
    await keeping(one, "office")
    assert (await asked(one, "initializePosition", "1", x=0.0, y=0.0, theta=0.0, mapId="office"))[0] == "FINISHED"
    assert listed(one) == {"office": "ENABLED"}
    one.robot[Mapping].load(one.robot[Mapping].grid, one.robot[Localization].pose)
    await one.until(lambda: listed(one) == {"map": "ENABLED", "office": "DISABLED"})
