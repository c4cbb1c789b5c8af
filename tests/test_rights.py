"""Every operation of every door declares what a client needs for it."""

from __future__ import annotations

import pytest

from roboglot.operations import Right
from roboglot.protocols import DOORS
from roboglot.protocols.cyberdog import dispatch as _cyberdog  # noqa: F401 - fills the table
from roboglot.protocols.cyberdog.table import operations
from roboglot.protocols.door import DoorType
from roboglot.protocols.robomaster import dispatch as _robomaster  # noqa: F401
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.slamware import application as _slamware  # noqa: F401
from roboglot.protocols.slamware.table import OPERATIONS


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.name)
def test_every_operation_declares_its_right(door: DoorType) -> None:
    assert [operation.key for operation in door.table() if operation.right is None] == []


def test_what_moves_the_robot_needs_more_than_sight() -> None:
    for table, key in (
        (OPERATIONS, "POST /api/core/motion/v1/actions"),
        (OPERATIONS, "POST /api/delivery/v1/tasks"),
        (TABLE, "chassis move"),
        (TABLE, "blaster fire"),
        (TABLE, "quit"),
        (operations, 1002),
        (operations, 6004),
    ):
        operation = table.get(key)  # type: ignore[attr-defined]
        assert operation.right is Right.DRIVE, key


def test_passwords_are_for_administrators() -> None:
    keys = [operation.key for operation in OPERATIONS if "password" in operation.key]
    assert keys
    assert all(OPERATIONS.get(key).right is Right.ADMIN for key in keys)  # type: ignore[union-attr]


def test_reading_needs_no_more_than_sight() -> None:
    for operation in OPERATIONS:
        secret = operation.key.endswith("/password")
        assert operation.right is Right.SEE or secret or not operation.key.startswith("GET ")
    for operation in TABLE:
        assert (operation.right is Right.SEE) or not operation.key.endswith("?")
