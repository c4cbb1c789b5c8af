"""What happened: frozen facts in the past tense, on one bounded stream. Doors turn them into pushes and reports."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from roboglot.model.geometry import Pose

if TYPE_CHECKING:
    from roboglot.model.actions import Action
    from roboglot.model.components.armor import HitKind, PlatePlace
    from roboglot.model.components.bluetooth import BluetoothDevice
    from roboglot.model.components.cargo import BoxState
    from roboglot.model.components.firmware import FirmwareProgress
    from roboglot.model.components.health import Fault
    from roboglot.model.components.touch import TouchKind
    from roboglot.model.sensing import LaserScan

QUEUE_MAX = 256  # what a slow reader may leave unread before the oldest is dropped


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened; ``stamp`` is robot time in seconds."""

    stamp: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionChanged(Event):
    """An action was accepted, began, paused, went on, reported feedback or ended; read its state from ``action``."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanTaken(Event):
    """The lidar finished a turn; ``odometry`` is where odometry puts base_link at that moment (odom frame)."""

    scan: LaserScan
    odometry: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryChanged(Event):
    """The charge moved by a whole percent, or charging began or ended."""

    percentage: float
    charging: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class DockContactChanged(Event):
    """The robot touched its charging dock, or left it."""

    docked: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class BumperPressed(Event):
    """Something touched the hull at ``zone``."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BumperReleased(Event):
    """Nothing touches the hull at ``zone`` any more."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PostureChanged(Event):
    """The legs reached another posture (a ``Posture`` value)."""

    posture: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseJumped(Event):
    """The robot was told or found out that it is elsewhere: the pose in the map changed without driving."""

    pose: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class MapReplaced(Event):
    """The map was cleared, loaded or begun anew; ``origin``: of the new map in the old one, if they are related."""

    origin: Pose | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PathBlocked(Event):
    """Something unexpected stands in the way of the action."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotBlocked(Event):
    """The action has waited for a free way for ``seconds``; told once."""

    action: Action
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopClosed(Event):
    """The robot knew a place again after a long way and straightened the map; ``shift``: m its own place moved by."""

    shift: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacesChanged(Event):
    """Points of interest were added, changed or removed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnnotationsChanged(Event):
    """Walls, tracks, areas, docks or landmarks of the map changed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BeadFired(Event):
    """A bead left the muzzle; ``ammo`` are left in the magazine."""

    ammo: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmorHit(Event):
    """Something hit the armor plate at ``place``."""

    place: PlatePlace
    kind: HitKind


@dataclass(frozen=True, slots=True, kw_only=True)
class AdapterLevelChanged(Event):
    """The logic level at a sensor adapter's port (both from 1) became ``level``."""

    adapter: int
    port: int
    level: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Spoke(Event):
    """The loudspeaker has said ``text``, which took ``seconds``; not ``audible``: no voice was there to be heard."""

    text: str
    seconds: float
    audible: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SoundPlayed(Event):
    """The loudspeaker has played the sound of that name."""

    name: str
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CliffDetected(Event):
    """There is no floor under ``zone``."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CliffCleared(Event):
    """There is floor under ``zone`` again."""

    zone: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EmergencyStopChanged(Event):
    """The emergency stop was engaged or released."""

    engaged: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class BrakeChanged(Event):
    """The wheels were let run free, or are held again."""

    released: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleBraked(Event):
    """Automatic emergency braking cut in, ``distance`` m before something."""

    distance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxChanged(Event):
    """A cargo box's door, lock, content or errors changed."""

    box: BoxState


@dataclass(frozen=True, slots=True, kw_only=True)
class JackChanged(Event):
    """The jack reached another stage (a ``JackStage`` value), took or lost a load, or raised an ``alarm``."""

    stage: str
    loaded: bool
    alarm: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftCalled(Event):
    """The lift took a call of this robot to ``floor``."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftArrived(Event):
    """The lift stands at ``floor`` because somebody called it there."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftDoorOpened(Event):
    """Its door stands wide open at ``floor``."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftDoorClosed(Event):
    """Its door is shut, the car at ``floor``."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftFailed(Event):
    """The lift cannot do what it was asked: ``reason`` is "out of service", "door blocked" or "overloaded"."""

    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRaised(Event):
    """Something is wrong now."""

    fault: Fault


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultCleared(Event):
    """It is no longer wrong, or somebody dismissed it."""

    fault: Fault


@dataclass(frozen=True, slots=True, kw_only=True)
class Touched(Event):
    """Somebody touched the touch pad."""

    kind: TouchKind


@dataclass(frozen=True, slots=True, kw_only=True)
class BluetoothConnected(Event):
    """The device is connected; ``again``: by itself, after it had been lost."""

    device: BluetoothDevice
    again: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class BluetoothLost(Event):
    """The device went out of reach or off; nobody asked for that."""

    device: BluetoothDevice


@dataclass(frozen=True, slots=True, kw_only=True)
class GearChanged(Event):
    """Somebody changed the speed gear on the remote control (a ``Gear`` value)."""

    gear: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MembersChanged(Event):
    """A member was added, renamed, removed, or has another face or voice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareChanged(Event):
    """An update went on by a percent or reached another state."""

    progress: FirmwareProgress


@dataclass(frozen=True, slots=True, kw_only=True)
class Rebooting(Event):
    """The robot restarts: everything under way is cancelled, its doors close and stay away for ``seconds``."""

    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Rebooted(Event):
    """The robot is up again; its doors open."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShuttingDown(Event):
    """The robot switches off now: its doors close; ``restart_after``: s until it starts again, None: it stays off."""

    restart_after: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerModeChanged(Event):
    """The robot fell asleep, woke up or saves power (a ``PowerMode`` value)."""

    mode: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskLow(Event):
    """Little storage space is left, bytes."""

    free: int


E_ = TypeVar("E_", bound=Event)


class Subscription(Generic[E_]):
    """A reader's own queue of events; the oldest are dropped (and counted) when it reads too slowly."""

    def __init__(self, stream: EventStream, types: tuple[type[E_], ...], maxlen: int) -> None:
        self._stream = stream
        self.types = types
        self._queue: deque[E_] = deque(maxlen=maxlen)
        self._wakeup = asyncio.Event()
        self.dropped = 0

    def __enter__(self) -> Subscription[E_]:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop receiving."""
        self._stream._forget(self)

    def push(self, event: E_) -> None:
        """Called by the stream."""
        if len(self._queue) == self._queue.maxlen:
            self.dropped += 1
        self._queue.append(event)
        self._wakeup.set()

    def drain(self) -> list[E_]:
        """All that is queued now, oldest first, without waiting."""
        events = list(self._queue)
        self._queue.clear()
        self._wakeup.clear()
        return events

    async def next(self) -> E_:
        """The next event, when it has come."""
        while not self._queue:
            self._wakeup.clear()
            await self._wakeup.wait()
        return self._queue.popleft()

    async def __aiter__(self) -> AsyncIterator[E_]:
        while True:
            yield await self.next()


class EventStream:
    """Hands every event to those who asked for its type."""

    def __init__(self) -> None:
        self._subscriptions: list[Subscription[Event]] = []
        self._listeners: list[tuple[type[Event], Callable[[Event], None]]] = []

    def publish(self, event: Event) -> None:
        """Deliver ``event`` at once: listeners are called, subscriptions get it queued."""
        for kind, listener in tuple(self._listeners):
            if isinstance(event, kind):
                listener(event)
        for subscription in self._subscriptions:
            if isinstance(event, subscription.types):
                subscription.push(event)

    def subscribe(self, *types: type[E_], maxlen: int = QUEUE_MAX) -> Subscription[E_]:
        """A queue of all events of these types from now on; close it (or use ``with``)."""
        subscription = Subscription(self, types, maxlen)
        self._subscriptions.append(subscription)  # type: ignore[arg-type]
        return subscription

    def listen(self, kind: type[E_], listener: Callable[[E_], None]) -> Callable[[], None]:
        """Call ``listener`` on every event of ``kind``, in place; returns what ends it. Listeners must be quick."""
        entry: tuple[type[Event], Callable[[Event], None]] = (kind, listener)  # type: ignore[assignment]
        self._listeners.append(entry)
        return lambda: self._listeners.remove(entry) if entry in self._listeners else None

    def _forget(self, subscription: Subscription[E_]) -> None:
        if subscription in self._subscriptions:
            self._subscriptions.remove(subscription)  # type: ignore[arg-type]
