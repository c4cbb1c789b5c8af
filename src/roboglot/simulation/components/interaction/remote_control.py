"""The connected bracelet as a remote control: the stick becomes driving actions, the gear's button an event."""

from __future__ import annotations

import asyncio

from roboglot.model.actions import Action
from roboglot.model.components.interaction.remote_control import REMOTE, Gear, RemoteControl
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import RobotError
from roboglot.model.events import GearChanged
from roboglot.model.geometry import STILL, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.system.bluetooth import SimulatedBluetooth

KEY = "remote.gear"
LIFETIME = 0.5  # s for which a command lasts without another: the device may be gone
# The gait of each gear, and the speed at the stick's end (m/s ahead, m/s sideways, rad/s).
PACES = {
    Gear.LOW: (Gait.TROT_SLOW, Twist(0.6, 0.2, 1.0)),
    Gear.MIDDLE: (Gait.TROT_MEDIUM, Twist(1.0, 0.3, 1.5)),
    Gear.HIGH: (Gait.TROT_FAST, Twist(1.6, 0.5, 2.0)),
}


class SimulatedRemoteControl(RemoteControl):
    """Reads the connected device ten times a second."""

    def __init__(self, robot: Robot, bluetooth: SimulatedBluetooth) -> None:
        self._robot, self._bluetooth = robot, bluetooth
        self._gear: Gear | None = None
        self._pressed = 0
        self._driving: Action | None = None
        self._keeping: asyncio.Task[None] | None = None

    @property
    def gear(self) -> Gear:
        if self._gear is None:
            kept = self._robot[Settings].get(KEY, Gear.LOW) if Settings in self._robot else Gear.LOW
            self._gear = Gear(kept)
        return self._gear

    async def set_gear(self, gear: Gear) -> None:
        if Settings in self._robot:
            await self._robot[Settings].put(KEY, int(gear))
        self._gear = gear

    def sense(self, stamp: float, _seconds: float) -> None:
        """Drive by the device's stick, and change the gear by its button."""
        gadget = self._bluetooth.gadget
        if gadget is None or gadget.gadget.kind != "bracelet":
            self._stop()
            return
        if gadget.presses != self._pressed:
            steps, self._pressed = gadget.presses - self._pressed, gadget.presses
            self._gear = Gear((self.gear + steps) % len(Gear))
            if Settings in self._robot:
                keeping = self._robot[Settings].keep(KEY, int(self._gear))
                self._keeping = asyncio.get_running_loop().create_task(keeping)
            self._robot.events.publish(GearChanged(stamp=stamp, gear=self._gear))
        if gadget.stick == STILL:
            self._stop()
        else:
            self._drive(gadget.stick)

    def _drive(self, stick: Twist) -> None:
        gait, top = PACES[self.gear]
        if Driving not in self._robot:
            return
        try:
            if Legs in self._robot and self._robot[Legs].gait is not None:
                self._robot[Legs].walk(gait)
            wanted = Twist(stick.x * top.x, stick.y * top.y, stick.yaw * top.yaw)
            self._driving = self._robot[Driving].drive(wanted, lifetime=LIFETIME, source=REMOTE)
        except RobotError:  # refused for now; the stick is read again soon
            self._driving = None

    def _stop(self) -> None:
        if self._driving is not None:
            self._driving.cancel("the stick was released")
            self._driving = None


def _fit(fit: Fitting) -> SimulatedRemoteControl | None:
    bluetooth = fit.find(SimulatedBluetooth)
    return SimulatedRemoteControl(fit.robot, bluetooth) if bluetooth else None


PART = Part(
    name="remote_control",
    interface=RemoteControl,
    fit=_fit,
    after=("bluetooth", "health"),
    sense=SimulatedRemoteControl.sense,
    every=5,
    first=5,
)
