"""Messages of the socket behind ``roboglot fleet``: requests to a fleet, and the states of its shards."""

from __future__ import annotations

from typing import Literal

import msgspec

SOCKET = "fleet.sock"
Verb = Literal["look", "stop", "restart", "reset", "move"]


class Request(msgspec.Struct, forbid_unknown_fields=True):
    """Request to a fleet. ``shard``: a shard's name, or a robot's for its shard; ``to``: destination shard of a robot.

    ``robot`` is for ``move`` only. An empty ``shard`` of ``stop`` and ``restart`` means all.
    """

    do: Verb = "look"
    shard: str = ""
    robot: str = ""
    to: str = ""


class RobotRow(msgspec.Struct):
    """One robot with its endpoints."""

    name: str
    body: str
    address: str


class Row(msgspec.Struct):
    """One shard in the table; memory in bytes, cpu in s, ``factor`` 1 if it keeps up.

    ``silent``: s without an answer of a ready one, 0 if it answers.
    """

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
    silent: float = 0.0


class Answer(msgspec.Struct):
    """All shards, and the reason for a refusal (empty: granted)."""

    shards: list[Row]
    nursery: int
    error: str = ""
