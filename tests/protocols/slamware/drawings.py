"""Annotations that tests draw on a map: a place, a wall, an area."""

from __future__ import annotations

import httpx

DESK = {"id": "d1", "pose": {"x": 1.0, "y": 0.5, "yaw": 0.25}, "metadata": {"display_name": "desk", "type": "ROOM"}}
WALL = {"start": {"x": 0.0, "y": 1.0}, "end": {"x": 2.0, "y": 1.0}, "metadata": {"colour": "red"}}
ICE = {
    "area": {"start": {"x": 0.0, "y": 0.0}, "end": {"x": 4.0, "y": 0.0}, "half_width": 0.5},
    "metadata": {"max_line_speed": "0.2"},
}


async def ok(reply: httpx.Response) -> httpx.Response:
    """Return the answer, which must be a success."""
    assert reply.status_code in (200, 204), reply.text
    return reply
