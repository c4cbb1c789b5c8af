"""Orders as a fleet control would send them, and valid ones at random."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import strategies as st

HEADER = {"headerId": 1, "timestamp": "2026-01-01T00:00:00.000Z", "manufacturer": "roboglot", "serialNumber": "a"}
Spot = tuple[float, float]


def order(
    id: str, spots: list[Spot], *, update: int = 0, first: int = 0, released: int | None = None, version: str = "3.0.0"
) -> dict[str, Any]:
    """Return an order through ``spots``. ``first``: the first node's number; ``released``: number of released nodes."""
    until = len(spots) if released is None else released
    nodes = [
        {
            "nodeId": f"n{first + i}",
            "sequenceId": 2 * (first + i),
            "released": i < until,
            "nodePosition": {"x": x, "y": y, "mapId": "map"},
            "actions": [],
        }
        for i, (x, y) in enumerate(spots)
    ]
    edges = [
        {
            "edgeId": f"e{first + i}",
            "sequenceId": 2 * (first + i) + 1,
            "released": i + 1 < until,
            "startNodeId": f"n{first + i}",
            "endNodeId": f"n{first + i + 1}",
            "actions": [],
        }
        for i in range(len(spots) - 1)
    ]
    return {**HEADER, "version": version, "orderId": id, "orderUpdateId": update, "nodes": nodes, "edges": edges}


def action(kind: str, id: str, blocking: str = "HARD", **parameters: Any) -> dict[str, Any]:
    listed = [{"key": key, "value": value} for key, value in parameters.items()]
    return {"actionType": kind, "actionId": id, "blockingType": blocking, "actionParameters": listed}


def instant(*actions: dict[str, Any], version: str = "3.0.0") -> dict[str, Any]:
    return {**HEADER, "version": version, "actions": list(actions)}


def encoded(message: dict[str, Any]) -> bytes:
    return json.dumps(message).encode()


ids = st.text(min_size=1, max_size=12)
metres = st.floats(-100, 100)
positions = st.fixed_dictionaries(
    {"x": metres, "y": metres, "mapId": st.just("map")},
    optional={
        "theta": st.floats(-3.14, 3.14),
        "allowedDeviationXY": st.floats(0, 2)
        | st.fixed_dictionaries({"a": st.floats(0, 2), "b": st.floats(0, 2), "theta": st.floats(-1.5, 1.5)}),
        "allowedDeviationTheta": st.floats(0, 3.14),
    },
)


@st.composite
def valid_orders(draw: st.DrawFn) -> dict[str, Any]:
    """Any order that the standard allows, of either version's fields."""
    count = draw(st.integers(1, 6))
    made = order(draw(ids), [(0.0, 0.0)] * count, update=draw(st.integers(0, 5)), first=draw(st.integers(0, 4)))
    released = draw(st.integers(1, count))
    numbers = iter(range(1000))
    for index, node in enumerate(made["nodes"]):
        node |= {"nodePosition": draw(positions), "released": index < released}
        kinds = draw(st.lists(st.sampled_from(["waitForTrigger", "startCharging", "beep"]), max_size=2))
        node["actions"] = [
            action(kind, f"a{next(numbers)}", draw(st.sampled_from(["NONE", "SOFT", "HARD"]))) for kind in kinds
        ]
    for index, edge in enumerate(made["edges"]):
        edge["released"] = index + 1 < released
        edge |= draw(
            st.fixed_dictionaries({}, optional={"maxSpeed": st.floats(0.1, 3), "rotationAllowed": st.booleans()})
        )
    return made
