"""The PWM outputs of an EP. They have no read-back, so their signals are sent again at every connection."""

from __future__ import annotations

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.setting import Setting
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.system.pwm import FREQUENCY_MAX, PwmPorts, PwmSignal
from roboglot.model.errors import InvalidGoal, NotFound

COUNT = 6
AT_REST = PwmSignal(0.075, 50.0)  # the robot's outputs after a session


class RoboMasterPwm(PwmPorts):
    """Assumes outputs at rest until they are set. Frequencies are whole Hz."""

    count = COUNT

    def __init__(self, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._client, self._supervisor = client, supervisor
        self._commanded: dict[int, Setting[PwmSignal]] = {}

    async def probe(self) -> None:
        """Send the signals again. Raises RefusedByRobot if there are no outputs."""
        await self._client.pwm.freq((1 << COUNT) - 1, round(AT_REST.frequency))  # changes nothing on a robot at rest
        for port, setting in self._commanded.items():
            await self._send(port, signal := setting.value)
            setting.read(signal)

    def signal(self, port: int) -> PwmSignal:
        if not 1 <= port <= COUNT:
            raise NotFound(f"there is no PWM output {port}; there are 1 to {COUNT}")
        return self._commanded[port].value if port in self._commanded else AT_REST

    def set_duty(self, port: int, duty: float) -> None:
        if not 0.0 <= duty <= 1.0:
            raise InvalidGoal(f"a duty is 0 to 1, not {duty}")
        self._set(port, PwmSignal(duty, self.signal(port).frequency))

    def set_frequency(self, port: int, frequency: float) -> None:
        if not 1.0 <= frequency <= FREQUENCY_MAX:
            raise InvalidGoal(f"a frequency is 1 to {FREQUENCY_MAX:g} Hz, not {frequency}")
        self._set(port, PwmSignal(self.signal(port).duty, float(round(frequency))))

    def reset(self) -> None:
        for port in tuple(self._commanded):
            self._set(port, AT_REST)

    def _set(self, port: int, signal: PwmSignal) -> None:
        setting = self._commanded.setdefault(port, Setting(self._supervisor, AT_REST))
        setting.send(f"PWM output {port}", signal, lambda: self._send(port, signal))

    async def _send(self, port: int, signal: PwmSignal) -> None:
        await self._client.pwm.value(1 << port - 1, round(signal.duty * 100, 3))
        await self._client.pwm.freq(1 << port - 1, round(signal.frequency))
