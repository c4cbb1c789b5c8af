"""Sensor adapters: inputs are polled in turn, level changes arrive as events."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

from roboglot.clients.errors import RefusedByRobot
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.system.link import Link
from roboglot.model.errors import NotFound
from roboglot.model.events import AdapterLevelChanged
from roboglot.model.robot import Robot
from roboglot.values import dataclass
from roboglot.wire.robomaster.telemetry import RAW_MAX, AdapterLevel

COUNT_MAX, PORTS = 6, 2
VOLTAGE_MAX = 3.3  # V


@dataclass(slots=True)
class _Input:
    """Voltage (V), level, and the period between its last two changes (s)."""

    voltage: float = 0.0
    level: bool = False
    period: float = 0.0


class RoboMasterAdapters(SensorAdapters):
    """The adapters that answer, without gaps from the first on; one input is polled every 0.1 s."""

    ports, voltage_max = PORTS, VOLTAGE_MAX

    def __init__(self, robot: Robot, client: RoboMasterClient, link: Link) -> None:
        self._clock, self._events, self._client, self._link = robot.clock, robot.events, client, link
        self.count = 0
        self._inputs: dict[tuple[int, int], _Input] = {}
        self._turn: Iterator[tuple[int, int]] = iter(())
        self._forget: Callable[[], None] = lambda: None

    async def probe(self) -> None:
        """Probe the adapters and subscribe to changes. Raises RefusedByRobot if there is none."""
        self._forget()
        self._forget = self._client.listen(self._on_push, AdapterLevel)
        self._inputs = {}
        try:
            for adapter, port in itertools.product(range(1, COUNT_MAX + 1), range(1, PORTS + 1)):
                await self._ask(adapter, port)
        except RefusedByRobot:
            if not self._inputs:
                raise
        self.count = max(adapter for adapter, _ in self._inputs)
        self._turn = itertools.cycle(tuple(self._inputs))
        await self._client.sensor_adapter.event(True)

    async def refresh(self) -> None:
        """Poll the next input; more at a time would delay the robot's other answers."""
        await self._ask(*next(self._turn))

    def voltage(self, adapter: int, port: int) -> float:
        return self._input(adapter, port).voltage

    def level(self, adapter: int, port: int) -> bool:
        return self._input(adapter, port).level

    def pulse_period(self, adapter: int, port: int) -> float:
        return self._input(adapter, port).period

    def _input(self, adapter: int, port: int) -> _Input:
        try:
            return self._inputs[adapter, port]
        except KeyError:
            raise NotFound(f"there is no port {port} on sensor adapter {adapter}") from None

    async def _ask(self, adapter: int, port: int) -> None:
        robot = self._client.sensor_adapter
        unit = VOLTAGE_MAX / RAW_MAX if self._client.as_robots else 1.0
        voltage = await robot.get_adc(adapter, port) * unit
        entry = self._inputs.setdefault((adapter, port), _Input())
        entry.voltage, entry.period = voltage, await robot.get_pulse_period(adapter, port) / 1000
        self._take(adapter, port, bool(await robot.get_io_level(adapter, port)))
        self._link.note_update(f"sensor adapter {adapter}")

    def _on_push(self, change: object) -> None:
        assert isinstance(change, AdapterLevel)
        if (change.id, change.port) in self._inputs:
            self._take(change.id, change.port, bool(change.level))

    def _take(self, adapter: int, port: int, level: bool) -> None:
        entry = self._inputs[adapter, port]
        if level != entry.level:
            entry.level = level
            stamp = self._clock.time()
            self._events.publish(AdapterLevelChanged(stamp=stamp, adapter=adapter, port=port, level=level))
