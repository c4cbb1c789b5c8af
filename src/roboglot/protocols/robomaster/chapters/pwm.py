"""The PWM chapter (manual 3.2.8)."""

from __future__ import annotations

from roboglot.model.components.system.pwm import PwmPorts
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import Hertz, Percent, PortMask
from roboglot.protocols.robomaster.table import TABLE

ROBOTS_DUTY = 0.075  # the robot's outputs after a session


def _ports(context: Context, mask: int) -> list[int]:
    """Return the outputs of a mask: bit n-1 is output n; bits without an output are ignored."""
    pwm = context.robot[PwmPorts]
    context.at_end("pwm", lambda: _restore(context))
    return [number for number in range(1, pwm.count + 1) if mask >> (number - 1) & 1]


def _restore(context: Context) -> None:
    pwm = context.robot[PwmPorts]
    pwm.reset()
    for number in range(1, pwm.count + 1) if context.profile.as_robots else ():
        pwm.set_duty(number, ROBOTS_DUTY)


@TABLE.on("pwm value", right=Right.DRIVE, needs=(PwmPorts,))
def set_value(context: Context, port: PortMask, data: Percent) -> None:
    """Set the duty of the masked outputs, percent: ``pwm value 1 50``, or by name as on real robots (3.2.8.1)."""
    for number in _ports(context, port):
        context.robot[PwmPorts].set_duty(number, data / 100)


@TABLE.on("pwm freq", right=Right.DRIVE, needs=(PwmPorts,))
def set_frequency(context: Context, port: PortMask, data: Hertz) -> None:
    """Set the frequency of the masked outputs, Hz (3.2.8.2)."""
    for number in _ports(context, port):
        context.robot[PwmPorts].set_frequency(number, float(data))
