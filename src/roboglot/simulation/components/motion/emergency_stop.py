"""The emergency stop: the button on the hull, the software's stop, and the brake's release."""

from __future__ import annotations

from msgspec import Struct

from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system.firmware import Module
from roboglot.model.errors import EmergencyStopped, Refused
from roboglot.model.events import BrakeChanged, EmergencyStopChanged, ModuleRestarting, Rebooting, ShuttingDown
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.motion.base import SimulatedBase

WHO, BRAKE = "emergency stop", "brake"


class EmergencyStopSection(Struct, frozen=True, forbid_unknown_fields=True):
    """An emergency stop button on the hull."""


class SimulatedEmergencyStop(EmergencyStop):
    """Emergency stop that cuts the drive and holds all actuators; requests of applications end with a restart."""

    def __init__(self, base: SimulatedBase, robot: Robot) -> None:
        self._base, self._robot = base, robot
        self._engaged = self._pressed = self._released = False
        for kind in (Rebooting, ShuttingDown):  # at its beginning: requests made meanwhile outlast it
            robot.events.listen(kind, lambda _: self._forget())
        robot.events.listen(ModuleRestarting, self._module_restarting)

    @property
    def engaged(self) -> bool:
        return self._engaged

    @property
    def pressed(self) -> bool:
        """True if the button on the hull is held down."""
        return self._pressed

    def press(self, down: bool) -> None:
        """Push the button on the hull, or release it again."""
        self._pressed = down
        self._set(down)

    def engage(self) -> None:
        self._set(True)

    def release(self) -> None:
        if self._pressed:
            raise Refused("the emergency stop button on the robot is pressed")
        self._set(False)

    def reset(self) -> None:
        """Let go of the button, and end all requests."""
        self._pressed = False
        self._forget()

    @property
    def brake_released(self) -> bool:
        return self._released

    def release_brake(self, released: bool) -> None:
        if released == self._released:
            return
        self._released = released
        if released:
            self._hold(BRAKE, "the brake is released")
        else:
            self._base.locks.unlock(BRAKE)
        self._base.roll_freely(released)
        self._robot.events.publish(BrakeChanged(stamp=self._robot.clock.time(), released=released))

    def _module_restarting(self, event: ModuleRestarting) -> None:
        if event.module is Module.BASE:
            self._forget()

    def _forget(self) -> None:
        """Forget the requests of applications: only the button on the hull outlasts a restart."""
        self._set(self._pressed)
        self.release_brake(False)

    def _set(self, engaged: bool) -> None:
        if engaged == self._engaged:
            return
        self._engaged = engaged
        if engaged:
            self._hold(WHO, "the emergency stop is engaged")
            self._robot.actuators.hold(WHO, EmergencyStopped("the emergency stop is engaged"))
        else:
            self._base.locks.unlock(WHO)
            self._robot.actuators.release(WHO)
        self._robot.events.publish(EmergencyStopChanged(stamp=self._robot.clock.time(), engaged=engaged))

    def _hold(self, who: str, reason: str) -> None:
        """Lock the base, block the wheels and cancel every motion."""
        self._base.locks.lock(who, EmergencyStopped(reason))
        self._base.cut()
        for action in self._robot.actions.running(BASE):
            action.cancel(reason)


def _fit(fit: Fitting) -> SimulatedEmergencyStop:
    return SimulatedEmergencyStop(fit.get(SimulatedBase), fit.robot)


PART = Part(name="emergency_stop", interface=EmergencyStop, section=EmergencyStopSection, fit=_fit, after=("base",))
