"""Messages of the socket behind ``roboglot fleet``: what is wished of a fleet, and how its shards are."""

from __future__ import annotations

from typing import Literal

import msgspec

SOCKET = "fleet.sock"
Verb = Literal["look", "stop", "restart", "reset", "move"]


class Request(msgspec.Struct, forbid_unknown_fields=True):
    """Request to a fleet. ``shard``: a shard's name, or a robot's for its shard; ``to``: where a robot moves.

    ``robot`` is for ``move`` alone. An empty ``shard`` of ``stop`` and ``restart`` means all.
    """

    do: Verb = "look"
    shard: str = ""
    robot: str = ""
    to: str = ""


class RobotRow(msgspec.Struct):
    """One robot: where it is reached."""

    name: str
    body: str
    address: str


class Row(msgspec.Struct):
    """One shard as the table shows it; memory in bytes, cpu in s, ``factor`` 1 where it keeps up."""

    name: str
    state: str
    pid: int
    robots: list[RobotRow]
    seconds: float
    restarts: int
    factor: float
    memory: int
    cpu: float
    console: str
    folder: str
    reason: str


class Answer(msgspec.Struct):
    """All shards, and why the wish was not granted (empty: it was)."""

    shards: list[Row]
    nursery: int
    error: str = ""
