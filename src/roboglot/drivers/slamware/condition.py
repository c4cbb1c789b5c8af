"""How a Slamware robot is: its faults, its emergency stop and brake, whether it sleeps."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.slamware.vocabulary import robot_errors
from roboglot.drivers.supervisor import Keeper
from roboglot.model.actions import Action
from roboglot.model.components.energy.power import POWER, Power, PowerMode
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.errors import Expired, InvalidGoal, Refused
from roboglot.model.events import BrakeChanged, EmergencyStopChanged, PowerModeChanged
from roboglot.model.robot import Robot
from roboglot.wire.slamware.devices import Parameter, Shutdown
from roboglot.wire.slamware.system import BaseError, Level, Part

MODES = {"awake": PowerMode.AWAKE, "waking_up": PowerMode.WAKING_UP, "asleep": PowerMode.ASLEEP}
PERIOD = 0.25  # s between two looks
CHANGED_WITHIN = 30.0  # s until it must sleep or be awake
MINUTES_MAX = 30 * 24 * 60
LEVELS = {Level.WARN: FaultLevel.WARNING, Level.ERROR: FaultLevel.ERROR, Level.FATAL: FaultLevel.FATAL}
STOP, BRAKE = "emergency stop", "brake released"
# By part and the part's own number, as known from robots; all others are called by their number.
NAMES = {
    (Part.SYSTEM, 0x0100): STOP,
    (Part.SYSTEM, 0x0700): BRAKE,
    (Part.SYSTEM, 0x0900): "not localized",
    (Part.POWER, 0x0100): "battery low",
    (Part.MOTION, 0x0100): "motor alarm",
    (Part.SENSOR, 0x0100): "bumper stuck",
}


class SlamwareCondition:
    """Asks for the health record, and tells Health and the emergency stop of it."""

    def __init__(self, robot: Robot, client: SlamwareClient) -> None:
        self._health, self._client = robot[Health], client
        self._present: dict[str, BaseError] = {}
        self.stopped = self.brake_released = False
        self.changed: Callable[[], None] = lambda: None

    async def refresh(self) -> None:
        """Raises SlamwareRefused for a robot that tells no health."""
        told = await self._client.get_robot_health()
        present = {_name(record): record for record in told.base_error}
        for name in self._present.keys() - present.keys():
            self._health.set(name, False, "", FaultLevel.ERROR)
        for name, record in present.items():
            part, level = record.component.name.lower(), LEVELS.get(record.level, FaultLevel.WARNING)
            self._health.set(name, True, part, level, record.message)
        self._present = present
        self.stopped = told.has_system_emergency_stop or STOP in present
        self.brake_released = BRAKE in present
        self.changed()


class SlamwareEmergencyStop(EmergencyStop):
    """The parameters ``base.emergency_stop`` and ``base.brake_release``; shows what the robot has confirmed."""

    def __init__(self, robot: Robot, client: SlamwareClient, keeper: Keeper, condition: SlamwareCondition) -> None:
        self._robot, self._client, self._keeper, self._condition = robot, client, keeper, condition
        self._engaged = self._released = self._known = False
        condition.changed = self._take

    async def learn(self) -> None:
        """Raises SlamwareRefused if there is none: found out once, by releasing what the robot says is released."""
        if self._known:
            return
        await self._condition.refresh()
        if not self._condition.stopped:
            await self._client.set_system_parameter(Parameter("base.emergency_stop", "off"))
            self._known = True

    @property
    def engaged(self) -> bool:
        return self._engaged

    def engage(self) -> None:
        self._set("base.emergency_stop", "on")
        for action in self._robot.actions.running(BASE):
            action.cancel("the emergency stop is engaged")

    def release(self) -> None:
        self._set("base.emergency_stop", "off")

    @property
    def brake_released(self) -> bool:
        return self._released

    def release_brake(self, released: bool) -> None:
        self._set("base.brake_release", "on" if released else "off")

    def _set(self, parameter: str, value: str) -> None:
        async def change() -> None:
            await self._client.set_system_parameter(Parameter(parameter, value))
            await self._condition.refresh()

        self._keeper.send(parameter, change())

    def _take(self) -> None:
        stamp = self._robot.clock.time()
        if self._condition.stopped != self._engaged:
            self._engaged = self._condition.stopped
            self._robot.events.publish(EmergencyStopChanged(stamp=stamp, engaged=self._engaged))
        if self._condition.brake_released != self._released:
            self._released = self._condition.brake_released
            self._robot.events.publish(BrakeChanged(stamp=stamp, released=self._released))


class SlamwarePower(Power):
    """``power/*``. It does not save power by itself, and counts in minutes when it is switched off."""

    def __init__(self, robot: Robot, client: SlamwareClient, keeper: Keeper) -> None:
        self._robot, self._client, self._keeper = robot, client, keeper
        self._mode = PowerMode.AWAKE

    async def learn(self) -> None:
        """Raises SlamwareRefused if it cannot sleep. Wakes nobody up."""
        if self._mode is PowerMode.AWAKE:
            await self._client.wakeup()

    async def refresh(self) -> None:
        """Ask how awake it is."""
        status = await self._client.get_power_status()
        mode = PowerMode.OFF if status.power_stage == "shutingdown" else MODES.get(status.sleep_mode, PowerMode.AWAKE)
        if mode is not self._mode:
            self._mode = mode
            self._robot.events.publish(PowerModeChanged(stamp=self._robot.clock.time(), mode=mode))

    @property
    def mode(self) -> PowerMode:
        return self._mode

    @property
    def automatic(self) -> bool:
        return False

    async def set_automatic(self, on: bool) -> None:
        if on:
            raise Refused("this robot does not save power by itself")

    def save(self, *, source: str = "") -> Action:
        raise Refused("this robot sleeps or is awake, and nothing between")

    def sleep(self, *, source: str = "") -> Action:
        return self._start("go asleep", self._client.hibernate, PowerMode.ASLEEP, source)

    def wake(self, *, source: str = "") -> Action:
        return self._start("wake up", self._client.wakeup, PowerMode.AWAKE, source)

    def shut_down(self, *, source: str = "", after: float = 0.0, restart_after: float | None = None) -> Action:
        minutes, restart = (round((seconds or 0.0) / 60 + 0.499) for seconds in (after, restart_after))
        if not (0 <= minutes <= MINUTES_MAX and 0 <= restart <= MINUTES_MAX):
            raise InvalidGoal("that is too far away")

        async def tell() -> None:
            await self._client.shutdown(Shutdown(minutes, restart))

        return self._start("shut down", tell, None, source)

    def _start(self, name: str, tell: Callable[[], Awaitable[None]], goal: PowerMode | None, source: str) -> Action:
        self._keeper.link.require()

        async def run(_: Action) -> None:
            with robot_errors():
                await tell()
                begun = self._robot.clock.time()
                while goal is not None and self._mode is not goal:
                    await self._robot.clock.sleep(PERIOD)
                    await self.refresh()
                    if self._robot.clock.time() - begun > CHANGED_WITHIN:
                        raise Expired(f"the robot is still {self._mode}")

        return self._robot.actions.start(name, run, resources=[POWER], goal=goal, source=source)


def _name(record: BaseError) -> str:
    return NAMES.get((record.component, record.component_error_code)) or f"robot's fault {record.error_code:08x}"
