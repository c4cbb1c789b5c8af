"""Power of a Slamware robot: awake, asleep or off."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.slamware.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.energy.power import POWER, Power, PowerMode, check_delays
from roboglot.model.errors import Expired, Refused
from roboglot.model.events import PowerModeChanged
from roboglot.model.robot import Robot
from roboglot.wire.slamware.chapters.system.devices import Shutdown

MODES = {"awake": PowerMode.AWAKE, "waking_up": PowerMode.WAKING_UP, "asleep": PowerMode.ASLEEP}
PERIOD = 0.25  # s between two polls
CHANGED_WITHIN = 30.0  # s until the robot must be asleep or awake


class SlamwarePower(Power):
    """``power/*``. It has no automatic low power and switches off after whole minutes."""

    def __init__(self, robot: Robot, client: SlamwareClient, supervisor: Supervisor) -> None:
        self._robot, self._client, self._supervisor = robot, client, supervisor
        self._mode = PowerMode.AWAKE

    async def probe(self) -> None:
        """Probe sleep; leaves a sleeping robot asleep. Raises SlamwareRefused if the robot cannot sleep."""
        if self._mode is PowerMode.AWAKE:
            await self._client.wakeup()

    async def refresh(self) -> None:
        """Poll the power mode."""
        status = await self._client.get_power_status()
        mode = PowerMode.OFF if status.power_stage == "shutingdown" else MODES.get(status.sleep_mode, PowerMode.AWAKE)
        if mode is not self._mode:
            self._mode = mode
            self._robot.events.publish(PowerModeChanged(stamp=self._robot.clock.time(), mode=mode))

    @property
    def mode(self) -> PowerMode:
        return self._mode

    @property
    def rests(self) -> tuple[PowerMode, ...]:
        return (PowerMode.ASLEEP,)

    @property
    def automatic(self) -> bool:
        return False

    async def set_automatic(self, on: bool) -> None:
        if on:
            raise Refused("this robot does not save power by itself")

    def save(self, *, source: str = "") -> Action:
        raise Refused("this robot is either asleep or awake")

    def sleep(self, *, source: str = "") -> Action:
        return self._start("go asleep", self._client.hibernate, PowerMode.ASLEEP, source)

    def wake(self, *, source: str = "") -> Action:
        return self._start("wake up", self._client.wakeup, PowerMode.AWAKE, source)

    def shut_down(self, *, source: str = "", after: float = 0.0, restart_after: float | None = None) -> Action:
        check_delays(after, restart_after)
        minutes, restart = (math.ceil((seconds or 0.0) / 60) for seconds in (after, restart_after))

        async def command() -> None:
            await self._client.shutdown(Shutdown(minutes, restart))

        return self._start("shut down", command, None, source)

    def _start(self, name: str, command: Callable[[], Awaitable[None]], goal: PowerMode | None, source: str) -> Action:
        self._supervisor.link.require()

        async def run(_: Action) -> None:
            with robot_errors():
                await command()
                begun = self._robot.clock.time()
                while goal is not None and self._mode is not goal:
                    await self._robot.clock.sleep(PERIOD)
                    await self.refresh()
                    if self._robot.clock.time() - begun > CHANGED_WITHIN:
                        raise Expired(f"the robot is still {self._mode}")

        return self._robot.actions.start(name, run, resources=[POWER], goal=goal, source=source)
