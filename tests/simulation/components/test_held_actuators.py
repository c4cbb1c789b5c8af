"""A robot that is stopped, asleep, restarting or without charge moves none of its actuators."""

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.logistics.cargo import Cargo, DoorState
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.motion.actuators import moves_actuator
from roboglot.model.components.motion.arm import Arm, ArmPosition
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.system.firmware import Firmware, Module
from roboglot.model.errors import EmergencyStopped, Refused
from roboglot.model.geometry import Pose

MOTIONS = {
    "jack": lambda robot: robot[Jack].raise_platform(),
    "box": lambda robot: robot[Cargo].open_box(0),
    "arm": lambda robot: robot[Arm].move_by(ArmPosition(0.02, 0.0)),
    "gripper": lambda robot: robot[Gripper].close(),
    "servo": lambda robot: robot[Servos].move_to(1, 1.5),
    "gimbal": lambda robot: robot[Gimbal].move_to(pitch=0.3),
}
HOLDS = {
    "stop": lambda robot: robot[EmergencyStop].engage(),
    "sleep": lambda robot: robot[Power].sleep(),
    "restart": lambda robot: robot[Firmware].restart(Module.BASE),
    "reboot": lambda robot: robot[Firmware].reboot(),
    "charge": lambda robot: robot[Battery].set_charge(0.0),
}
WAITS = {"sleep": 3.0, "charge": 1.5}  # s until it lies; until the battery is looked at


def shape(robot):
    jaws, box, arm = robot[Gripper].opening, robot[Cargo].box(0).door, robot[Arm].position
    return robot[Jack].position, box, arm, jaws, robot[Servos].angle(1), robot[Gimbal].angles.pitch


@pytest.mark.parametrize("hold", HOLDS)
async def test_no_actuator_moves_while_the_robot_is_held(simulate, hold):
    sim = simulate(start=Pose(2, 2))
    robot = sim.robot
    sim.world.start()
    await sim.clock.advance(0.1)
    before = shape(robot)
    moving = [move(robot) for move in MOTIONS.values()]
    assert all(map(moves_actuator, moving))
    await sim.clock.advance(0.06)
    HOLDS[hold](robot)
    await sim.clock.advance(WAITS.get(hold, 0.2))
    held = shape(robot)
    assert [a.name for a in moving if not a.status.ended] == []
    if hold not in WAITS:
        assert [a.name for a in moving if a.status is not ActionStatus.CANCELED] == []
        assert all(now != then for now, then in zip(held, before, strict=True))
    for move in [*MOTIONS.values(), lambda robot: robot[Blaster].fire()]:
        with pytest.raises(EmergencyStopped if hold == "stop" else Refused):
            move(robot)
    await sim.clock.advance(0.5)
    assert shape(robot) == held
    assert not [action for action in robot.actions.running() if moves_actuator(action)]


async def test_actuators_move_again_when_asked_after_a_stop(simulate):
    sim = simulate()
    robot = sim.robot
    sim.world.start()
    robot[EmergencyStop].engage()
    robot[EmergencyStop].release()
    robot[EmergencyStop].release_brake(True)  # holds the wheels only
    await sim.clock.advance(0.1)
    assert robot[Cargo].box(0).door is DoorState.CLOSED
    opening = robot[Cargo].open_box(0)
    await sim.clock.advance(0.2)
    assert (opening.status, robot[Cargo].box(0).door) == (ActionStatus.EXECUTING, DoorState.OPENING)
