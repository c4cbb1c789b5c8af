"""Pushes to the app about the bracelet: lost and found, newer firmware, its update, its gear.

Pushes 8003, 8008, 8010, 8012.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.system.bluetooth import Bluetooth, DeviceUpdate, DeviceUpdateStage
from roboglot.model.events import ActionChanged, BluetoothConnected, BluetoothLost, GearChanged
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.table import push
from roboglot.wire.cyberdog.codes import Code

BRACELET_LOST = push(Code.BLUETOOTH_LOST)
OFFERED = push(Code.BLUETOOTH_UPDATE_OFFERED)
PROGRESS = push(Code.BLUETOOTH_UPDATE_PROGRESS)
GEAR = push(Code.GEAR_CHANGED)
BEGUN, SUCCEEDED, FAILED = 0, 1, 2  # ``status`` of 8010, beside those of the stages
STAGES = {  # … under way; one more: it failed
    DeviceUpdateStage.UNPACKING: 3,
    DeviceUpdateStage.STARTING: 5,
    DeviceUpdateStage.SENDING: 7,
    DeviceUpdateStage.RESTARTING: 9,
}
LEFT = "no app waits for it any more"  # why work ends with its request
STEP = 0.05  # of the progress between two pushes


class Bracelet:
    """Lives as long as the door is open."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self._robot, self._app = robot, app
        self._update: Action | None = None
        self._pushed: DeviceUpdate | None = None
        self._waiting: Counter[int] = Counter()  # requests, by the number of their scan
        events = robot.events
        self._leave: list[Callable[[], None]] = [
            events.listen(BluetoothLost, lambda _: app.push(BRACELET_LOST, {"disconnected": True})),
            events.listen(BluetoothConnected, self._connected),
            events.listen(GearChanged, lambda event: app.push(GEAR, {"data": event.gear})),
            events.listen(ActionChanged, self._progressed),
        ]
        app.on_found.append(self.offer)

    @property
    def updating(self) -> bool:
        """True while this door updates the bracelet's firmware."""
        return self._update is not None and not self._update.status.ended

    def follow(self, update: Action) -> None:
        """Report the progress of ``update`` until it has ended."""
        self._update, self._pushed = update, None
        self._push(BEGUN, 0.0, "")

    @contextmanager
    def waiting_for(self, scan: Action) -> Iterator[None]:
        """Wait for a scan, which ends with the last request that waits if this door began it."""
        self._waiting[scan.id] += 1
        try:
            yield
        finally:
            self._waiting[scan.id] -= 1
            if not self._waiting[scan.id]:
                del self._waiting[scan.id]
                if scan.source == SOURCE and not scan.status.ended:
                    scan.cancel(LEFT)

    def offer(self) -> None:
        """Report newer firmware for the connected device, if there is any."""
        if Bluetooth not in self._robot:
            return
        radio = self._robot[Bluetooth]
        if radio.connected and radio.update_available:
            self._app.push(OFFERED, {"data": f"{radio.connected.firmware} {radio.update_available}"})

    def close(self) -> None:
        """Stop reporting."""
        for leave in self._leave:
            leave()

    def _connected(self, event: BluetoothConnected) -> None:
        if event.again:
            self._app.push(BRACELET_LOST, {"disconnected": False})
        self.offer()

    def _progressed(self, event: ActionChanged) -> None:
        action = event.action
        if action is not self._update:
            return
        now, before = action.feedback, self._pushed
        if action.status.ended:
            self._update = None
            if action.status is ActionStatus.SUCCEEDED:
                self._push(SUCCEEDED, 1.0, action.reason)
            elif isinstance(now, DeviceUpdate):
                self._push(STAGES[now.stage] + 1, now.share, action.reason)
            else:
                self._push(FAILED, 0.0, action.reason)
        elif isinstance(now, DeviceUpdate) and (
            before is None or now.stage is not before.stage or now.share >= before.share + STEP
        ):
            self._pushed = now
            self._push(STAGES[now.stage], now.share, "")

    def _push(self, status: int, progress: float, message: str) -> None:
        self._app.push(PROGRESS, {"status": status, "progress": progress, "message": message})
