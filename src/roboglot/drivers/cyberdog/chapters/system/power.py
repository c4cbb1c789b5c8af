"""Power of a dog: awake, low power or off. Reported by heartbeats, changed by 9031 and 10002 to 10006."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping

from roboglot.clients.cyberdog import CyberDogClient
from roboglot.drivers.cyberdog.telemetry import StatusPoll
from roboglot.drivers.cyberdog.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.energy.power import POWER, Power, PowerMode, check_delays
from roboglot.model.errors import Expired, Refused
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.codes import MachineState

MODES: Mapping[int, PowerMode] = {MachineState.LOW_POWER: PowerMode.LOW_POWER, MachineState.SHUT_DOWN: PowerMode.OFF}
PERIOD, AWAKE_WITHIN = 0.25, 30.0  # s


class CyberDogPower(Power):
    """The dog enters low power only by itself; it cannot be sent there or to sleep."""

    def __init__(self, robot: Robot, client: CyberDogClient, supervisor: Supervisor, status: StatusPoll) -> None:
        self._robot, self._client, self._supervisor, self._status = robot, client, supervisor, status

    async def probe(self) -> None:
        """Probe low power; leaves a sleeping dog asleep. Raises CyberDogRefused or NoAnswer without it."""
        if self.mode is PowerMode.AWAKE:
            await self._client.leave_low_power()

    @property
    def mode(self) -> PowerMode:
        beat = self._client.heartbeat
        return MODES.get(beat.state, PowerMode.AWAKE) if beat else PowerMode.AWAKE

    @property
    def rests(self) -> tuple[PowerMode, ...]:
        return ()

    @property
    def automatic(self) -> bool:
        return self._status.saves

    async def set_automatic(self, on: bool) -> None:
        self._supervisor.link.require()
        with robot_errors():
            await self._client.set_automatic_low_power(on)
            await self._status.ask()

    def save(self, *, source: str = "") -> Action:
        raise Refused("this dog enters low power only by itself")

    def sleep(self, *, source: str = "") -> Action:
        raise Refused("this dog's only sleep mode is low power")

    def wake(self, *, source: str = "") -> Action:
        return self._start("wake up", self._wake, source)

    def shut_down(self, *, source: str = "", after: float = 0.0, restart_after: float | None = None) -> Action:
        check_delays(after, restart_after)
        if restart_after:
            raise Refused("this dog can only restart at once")

        async def command() -> None:
            await self._robot.clock.sleep(after)
            await (self._client.power_off() if restart_after is None else self._client.reboot())

        return self._start("shut down", command, source)

    async def _wake(self) -> None:
        await self._client.leave_low_power()
        clock, begun = self._robot.clock, self._robot.clock.time()
        while self.mode is not PowerMode.AWAKE:
            if clock.time() - begun > AWAKE_WITHIN:
                raise Expired("the dog does not wake up")
            await clock.sleep(PERIOD)

    def _start(self, name: str, command: Callable[[], Awaitable[None]], source: str) -> Action:
        self._supervisor.link.require()

        async def run(_: Action) -> None:
            with robot_errors():
                await command()

        return self._robot.actions.start(name, run, resources=[POWER], source=source)
