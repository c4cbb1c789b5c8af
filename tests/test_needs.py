"""Every operation of every door declares which components of the robot it needs."""

from __future__ import annotations

import pytest

from roboglot.console.verbs import maps, robots
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.robot import Robot
from roboglot.protocols import DOORS
from roboglot.protocols.door import DoorType
from roboglot.protocols.robomaster.chapters import chassis, gimbal
from roboglot.protocols.slamware.chapters.slam import localization
from roboglot.protocols.slamware.chapters.system import system
from tests.component_use import used_by


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.name)
def test_declared_needs_are_what_handlers_use(door: DoorType) -> None:
    wrong = {}
    for operation in door.table():
        # Functions of programs keep parts of their own (Session.part), which sources do not show: what these need is
        # found by calling every function on a bare robot, in tests/protocols/visual/test_capabilities.py.
        used = used_by(operation.handler)
        if not (operation.needs >= used if door.name == "visual" else operation.needs | operation.some == used):
            wrong[operation.key] = [kind.__name__ for kind in used]
    assert wrong == {}


def test_verbs_need_what_their_handlers_use() -> None:
    used: dict[str, object] = {}
    while new := [verb for verb in robots.VERBS if verb.key not in used]:  # looking brings further modules' verbs
        used |= {verb.key: used_by(verb.handler) for verb in new}
    assert {verb.key: used[verb.key] for verb in robots.VERBS if verb.needs != used[verb.key]} == {}
    assert robots.VERBS.get("add_line") is not None, maps  # whose import brings the verbs of maps


def test_use_follows_the_functions_a_handler_calls() -> None:
    assert used_by(chassis.set_speed) == {Driving}  # through _drive
    assert used_by(chassis.get_speed) == {Odometry, Base}  # through readings.speed
    assert used_by(gimbal.get_attitude) == {Gimbal}
    assert used_by(localization.get_odo_pose) == {
        Odometry
    }  # the pose of a reading, not a property of that name elsewhere
    assert used_by(system.get_laser_scan) >= {Localization}  # through desk.laser


async def knows_without(robot: Robot) -> object:
    return robot[Gimbal] if Gimbal in robot else robot[Base]


def test_components_tested_for_are_optional() -> None:
    assert used_by(knows_without) == {Base}
