"""Every operation of every door declares what a client needs for it."""

from __future__ import annotations

import pytest

from roboglot.operations import Right
from roboglot.protocols import DOORS
from roboglot.protocols.cyberdog import dispatch as _cyberdog  # noqa: F401 - fills the table
from roboglot.protocols.cyberdog.table import TABLE as CODES
from roboglot.protocols.door import DoorType
from roboglot.protocols.robomaster import dispatch as _robomaster  # noqa: F401
from roboglot.protocols.robomaster.table import TABLE as TEXT
from roboglot.protocols.slamware import dispatch as _slamware  # noqa: F401
from roboglot.protocols.slamware.table import TABLE as REST
from tests.narrowing import known


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.name)
def test_every_operation_declares_its_right(door: DoorType) -> None:
    assert [operation.key for operation in door.table() if operation.right is None] == []


def test_moving_the_robot_needs_more_than_see() -> None:
    for table, key in (
        (REST, "POST /api/core/motion/v1/actions"),
        (REST, "POST /api/delivery/v1/tasks"),
        (TEXT, "chassis move"),
        (TEXT, "blaster fire"),
        (TEXT, "quit"),
        (CODES, 1002),
        (CODES, 6004),
    ):
        (operation,) = (operation for operation in table if operation.key == key)
        assert operation.right is Right.DRIVE, key


def test_passwords_are_for_administrators() -> None:
    keys = [operation.key for operation in REST if "password" in operation.key]
    assert keys
    assert all(known(REST.get(key)).right is Right.ADMIN for key in keys)


def test_reading_needs_no_more_than_sight() -> None:
    for operation in REST:
        secret = operation.key.endswith("/password")
        assert operation.right is Right.SEE or secret or not operation.key.startswith("GET ")
    for operation in TEXT:
        assert (operation.right is Right.SEE) or not operation.key.endswith("?")
