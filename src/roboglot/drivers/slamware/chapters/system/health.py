"""Health of a Slamware robot: its faults, emergency stop and brake."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.events import BrakeChanged, EmergencyStopChanged
from roboglot.model.robot import Robot
from roboglot.wire.slamware.chapters.system.devices import Parameter, Settable
from roboglot.wire.slamware.chapters.system.system import BaseError, HealthPart, Level

LEVELS = {Level.WARN: FaultLevel.WARNING, Level.ERROR: FaultLevel.ERROR, Level.FATAL: FaultLevel.FATAL}
STOP, BRAKE = "emergency stop", "brake released"
# Names by component and its own error number, as seen on robots; other faults are named by their number.
NAMES = {
    (HealthPart.SYSTEM, 0x0100): STOP,
    (HealthPart.SYSTEM, 0x0700): BRAKE,
    (HealthPart.SYSTEM, 0x0900): "not localized",
    (HealthPart.POWER, 0x0100): "battery low",
    (HealthPart.MOTION, 0x0100): "motor alarm",
    (HealthPart.SENSOR, 0x0100): "bumper stuck",
}


class SlamwareHealth:
    """Polls the health record and updates Health and the emergency stop."""

    def __init__(self, robot: Robot, client: SlamwareClient) -> None:
        self._health, self._client = robot[Health], client
        self._present: dict[str, BaseError] = {}
        self.stopped = self.brake_released = False
        self.changed: Callable[[], None] = lambda: None

    async def refresh(self) -> None:
        """Poll once. Raises SlamwareRefused for a robot that reports no health."""
        reply = await self._client.get_robot_health()
        present = {_name(record): record for record in reply.base_error}
        for name in self._present.keys() - present.keys():
            self._health.set(name, False, "", FaultLevel.ERROR)
        for name, record in present.items():
            part, level = record.component.name.lower(), LEVELS.get(record.level, FaultLevel.WARNING)
            self._health.set(name, True, part, level, record.message)
        self._present = present
        self.stopped = reply.has_system_emergency_stop or STOP in present
        self.brake_released = BRAKE in present
        self.changed()


class SlamwareEmergencyStop(EmergencyStop):
    """The parameters ``base.emergency_stop`` and ``base.brake_release``; shows the confirmed state."""

    def __init__(self, robot: Robot, client: SlamwareClient, supervisor: Supervisor, health: SlamwareHealth) -> None:
        self._robot, self._client, self._supervisor, self._health = robot, client, supervisor, health
        self._engaged = self._released = self._known = False
        health.changed = self._take

    async def probe(self) -> None:
        """Probe once, by releasing a released stop. Raises SlamwareRefused if there is none."""
        if self._known:
            return
        await self._health.refresh()
        if not self._health.stopped:
            await self._client.set_system_parameter(Parameter("base.emergency_stop", "off"))
            self._known = True

    @property
    def engaged(self) -> bool:
        return self._engaged

    def engage(self) -> None:
        for action in self._robot.actions.running(BASE):
            action.cancel("the emergency stop is engaged")
        self._set("base.emergency_stop", "on", always=True)

    def release(self) -> None:
        self._set("base.emergency_stop", "off")

    @property
    def brake_released(self) -> bool:
        return self._released

    def release_brake(self, released: bool) -> None:
        self._set("base.brake_release", "on" if released else "off")

    def _set(self, parameter: Settable, value: str, *, always: bool = False) -> None:
        async def change() -> None:
            await self._client.set_system_parameter(Parameter(parameter, value))
            await self._health.refresh()

        self._supervisor.send(parameter, change(), always=always)

    def _take(self) -> None:
        stamp = self._robot.clock.time()
        if self._health.stopped != self._engaged:
            self._engaged = self._health.stopped
            self._robot.events.publish(EmergencyStopChanged(stamp=stamp, engaged=self._engaged))
        if self._health.brake_released != self._released:
            self._released = self._health.brake_released
            self._robot.events.publish(BrakeChanged(stamp=stamp, released=self._released))


def _name(record: BaseError) -> str:
    return NAMES.get((record.component, record.component_error_code)) or f"robot's fault {record.error_code:08x}"
