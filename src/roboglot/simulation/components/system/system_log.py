"""The system's log: one line per event. Uploads take as long as the link needs; the maker's server is always up."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Sequence

from roboglot.model.actions import Action
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.network import Network
from roboglot.model.components.system.system_log import LINE_MAX, LINES_MAX, SYSTEM_LOG, SystemLog, Upload
from roboglot.model.errors import Refused
from roboglot.model.events import (
    ActionChanged,
    BatteryChanged,
    BluetoothConnected,
    BluetoothLost,
    BumperPressed,
    CliffDetected,
    DiskLow,
    DockContactChanged,
    EmergencyStopChanged,
    Event,
    FaultCleared,
    FaultRaised,
    NetworkChanged,
    PowerModeChanged,
    Rebooted,
    Rebooting,
    ShuttingDown,
)
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part

BANDWIDTH = 250_000  # bytes/s
HANDSHAKE = 1.0  # s
UPLOADS_MAX = 50
WRITTEN: tuple[type[Event], ...] = (
    ActionChanged, BatteryChanged, BluetoothConnected, BluetoothLost, BumperPressed, CliffDetected, DiskLow,
    DockContactChanged, EmergencyStopChanged, FaultCleared, FaultRaised, NetworkChanged, PowerModeChanged, Rebooted,
    Rebooting, ShuttingDown,
)  # fmt: skip


class SimulatedSystemLog(SystemLog):
    """Log of lines, not events, which would keep objects alive."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._lines: deque[str] = deque(maxlen=LINES_MAX)
        self._uploads: deque[Upload] = deque(maxlen=UPLOADS_MAX)
        for kind in WRITTEN:
            robot.events.listen(kind, self._write)

    @property
    def lines(self) -> Sequence[str]:
        return tuple(self._lines)

    @property
    def uploads(self) -> Sequence[Upload]:
        return tuple(self._uploads)

    def upload(self, *, source: str = "") -> Action:
        async def run(action: Action) -> None:
            text = "\n".join(self.lines).encode(errors="backslashreplace")  # a text of Python's may have half a pair
            for share in range(1, 11):
                self._reach()
                await self._robot.clock.sleep((HANDSHAKE + len(text) / BANDWIDTH) / 10)
                action.report(share / 10)
            self._reach()
            stamp = self._robot.clock.time()
            self._uploads.append(Upload(stamp, len(text), hashlib.sha256(text).hexdigest()))

        return self._robot.actions.start("log upload", run, resources=[SYSTEM_LOG], source=source)

    def _write(self, event: Event) -> None:
        self._lines.append(_line(event))

    def _reach(self) -> None:
        if Network not in self._robot or not self._robot[Network].state.internet:
            raise Refused("the internet cannot be reached")


def _line(event: Event) -> str:
    words = type(event).__name__
    match event:
        case ActionChanged():
            words += f" {event.action.name} {event.action.status.name.lower()}"
        case FaultRaised() | FaultCleared():
            words += f" {event.fault.level.name.lower()} {event.fault.name}: {event.fault.message}"
        case NetworkChanged():
            words += f" {event.state.mode} {event.state.ssid or '-'} {event.state.address or '-'}"
        case BatteryChanged():
            words += f" {event.percentage:.0%}{' charging' if event.charging else ''}"
        case DockContactChanged():
            words += " docked" if event.docked else " off the dock"
        case PowerModeChanged():
            words += f" {event.mode}"
    return f"{event.stamp:.3f} {words}"[:LINE_MAX]


def _fit(fit: Fitting) -> SimulatedSystemLog | None:
    return SimulatedSystemLog(fit.robot) if Firmware in fit.robot else None


PART = Part(name="system_log", interface=SystemLog, fit=_fit, after=("firmware",))
