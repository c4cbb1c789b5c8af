"""The robot's events in the vendor's words, kept until a client reads them (chapter "platform", events)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import Timer
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.navigation import NAVIGATE, NavigationFeedback
from roboglot.model.components.system.firmware import FirmwareState
from roboglot.model.errors import Blocked, DockNotFound, Unreachable
from roboglot.model.events import (
    ActionChanged,
    BatteryChanged,
    BrakeChanged,
    BumperPressed,
    CliffDetected,
    CorridorEntered,
    DeliveryReported,
    DockContactChanged,
    FirmwareChanged,
    LocalizationRecovered,
    LoopClosed,
    PathBlocked,
    Rebooting,
    RecoveryMeans,
    ShuttingDown,
)
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.delivery.vocabulary import NEWS
from roboglot.protocols.slamware.chapters.motion.action_book import ActionBook
from roboglot.protocols.slamware.chapters.motion.errands import PART
from roboglot.protocols.slamware.chapters.motion.occupancy import stands_in_something
from roboglot.protocols.slamware.chapters.multi_floor.elevator_events import RideEvents
from roboglot.protocols.slamware.chapters.system.charging_monitor import ChargingWatch
from roboglot.protocols.slamware.chapters.system.fault_alarms import FaultAlarms
from roboglot.protocols.slamware.vocabulary import action_word, milliseconds
from roboglot.wire.slamware.chapters.delivery import DeliveryEvent
from roboglot.wire.slamware.chapters.platform import ElevatorEvent, GeneralEvent, RobotEvent

EVENTS_MAX = 256  # unread events, beyond which the oldest is dropped
HOMING = ("GoHomeAction", "MultiFloorBackHomeAction")
DRIVES = (NAVIGATE, "dock", "sweep")  # actions that plan routes
KEPT_AT_RESTARTS = (DeliveryEvent.ROBOT_REBOOT, GeneralEvent.POWER_OFF)  # clients read them after the restart
BLOCKED_AFTER = 180.0  # s in one place before ROBOT_BLOCKED
OCCUPIED_AGAIN = 5.0  # s until the same obstacle is reported again
TOGETHER = 0.5  # s
SAME_PLACE = 0.5  # m within which it is the same one


class EventLog:
    """A ring of events. Reading empties it, unless ``keep``: then every reader sees the last ones again."""

    def __init__(self, robot: Robot, actions: ActionBook, *, keep: bool) -> None:
        self._robot = robot
        self._actions = actions
        self._keep = keep
        self._ring: deque[RobotEvent] = deque(maxlen=EVENTS_MAX)
        self._epoch = robot.starts.robot  # from which the events' times count
        self._charging = self._upgrading = False
        self._blocked: tuple[Action, Timer] | None = None
        self._occupied: PathBlocked | None = None  # the last one reported
        self._rides = RideEvents()
        self._dock = ChargingWatch(robot, lambda: self.note(GeneralEvent.CHARGING_BASE_FAILED))
        self._faults = FaultAlarms(robot, lambda stamp: self.note(GeneralEvent.DEVICE_ERROR, stamp))
        self._docked_at = self._given_at = self._reset_at = -math.inf  # robot time, s: contact, pose of a lost robot
        self._looked = 0  # the drive for which the robot's own place has been checked
        self._endings: list[Callable[[], None]] = []

    def start(self) -> None:
        """Start listening."""
        listen = self._robot.events.listen
        self._charging = Battery in self._robot and self._robot[Battery].state.charging
        self._endings = [
            listen(DockContactChanged, self._dock_changed),
            listen(LocalizationRecovered, self._recovered),
            listen(BatteryChanged, self._battery_changed),
            listen(BumperPressed, lambda event: self.note(GeneralEvent.BUMPER_TRIGGERED, event.stamp)),
            listen(PathBlocked, self._path_blocked),
            listen(ActionChanged, self._action_changed),
            listen(CliffDetected, lambda event: self.note(GeneralEvent.CLIFF_DETECTED, event.stamp)),
            listen(ShuttingDown, lambda event: self.note(GeneralEvent.POWER_OFF, event.stamp)),
            listen(LoopClosed, lambda event: self.note(GeneralEvent.MAP_LOOP_CLOSURE, event.stamp)),
            listen(CorridorEntered, lambda e: self.note(GeneralEvent.PASS_THE_NARROW_CORRIDOR, e.stamp)),
            listen(BrakeChanged, self._brake_changed),
            listen(FirmwareChanged, self._firmware_changed),
            listen(DeliveryReported, self._delivery_reported),
            listen(Rebooting, lambda event: self.note(DeliveryEvent.ROBOT_REBOOT, event.stamp)),
        ]
        self._dock.start()
        self._faults.start()

    def close(self) -> None:
        """Stop listening."""
        for end in self._endings:
            end()
        self._dock.close()
        self._faults.close()
        self._unblock()

    def read(self) -> list[RobotEvent]:
        """Return events since the last read, oldest first."""
        self._lose_old()
        events = list(self._ring)
        if not self._keep:
            self._ring.clear()
        return events

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Keep events while inside ``with``: HEAD changes nothing."""
        before, self._keep = self._keep, True
        try:
            yield
        finally:
            self._keep = before

    def note(self, kind: GeneralEvent | ElevatorEvent | DeliveryEvent, stamp: float | None = None) -> None:
        """Record an event at ``stamp`` (robot time, s), or now."""
        self._lose_old()
        since = milliseconds(self._robot.clock.time() if stamp is None else stamp, self._epoch)
        self._ring.append(RobotEvent(kind, str(since)))

    def _lose_old(self) -> None:
        """Lose events from before a restart of the robot: it kept them in memory. Few kinds remain."""
        if self._epoch != self._robot.starts.robot:
            self._epoch = self._robot.starts.robot
            kept = [RobotEvent(event.type, "0") for event in self._ring if event.type in KEPT_AT_RESTARTS]
            self._ring = deque(kept, maxlen=EVENTS_MAX)

    def _dock_changed(self, event: DockContactChanged) -> None:
        self.note(GeneralEvent.ON_DOCK if event.docked else GeneralEvent.OFF_DOCK, event.stamp)
        if event.docked:
            self._docked_at = self._robot.clock.time()
            self._look_for_reset()

    def _recovered(self, event: LocalizationRecovered) -> None:
        if event.means is RecoveryMeans.GIVEN:
            self._given_at = self._robot.clock.time()
            self._look_for_reset()

    def _look_for_reset(self) -> None:
        """Note the reset of a lost robot that is pushed onto its dock: contact and pose come together."""
        if abs(self._given_at - self._docked_at) < TOGETHER:
            self.note_reset(self._docked_at)

    def note_reset(self, since: float) -> None:
        """Record that the robot, pushed onto its dock, took its pose; not if recorded ``since`` (robot time, s)."""
        if self._reset_at < since:
            self._reset_at = self._robot.clock.time()
            self.note(GeneralEvent.RESET_MAP_TO_DOCK)

    def _battery_changed(self, event: BatteryChanged) -> None:
        if event.charging != self._charging:
            self._charging = event.charging
            self.note(GeneralEvent.START_CHARGING if event.charging else GeneralEvent.STOP_CHARGING, event.stamp)

    def _brake_changed(self, event: BrakeChanged) -> None:
        if event.released:
            self.note(GeneralEvent.BRAKE_RELEASED, event.stamp)

    def _firmware_changed(self, event: FirmwareChanged) -> None:
        upgrading = event.progress.state is FirmwareState.INSTALLING
        if upgrading and not self._upgrading:
            self.note(GeneralEvent.UPGRADE, event.stamp)
        self._upgrading = upgrading

    def _delivery_reported(self, event: DeliveryReported) -> None:
        if event.news in NEWS:
            self.note(NEWS[event.news], event.stamp)

    def _path_blocked(self, event: PathBlocked) -> None:
        if self._occupied is None or not _same_obstacle(self._occupied, event):
            self._occupied = event
            self.note(GeneralEvent.PATH_OCCUPIED, event.stamp)
        if self._blocked is None or self._blocked[0] is not event.action:
            self._unblock()
            self._blocked = (event.action, self._robot.clock.call_later(BLOCKED_AFTER, self._blocked_long))

    def _blocked_long(self) -> None:
        self._blocked = None
        self.note(GeneralEvent.ROBOT_BLOCKED, self._robot.clock.time())

    def _unblock(self) -> None:
        if self._blocked is not None:
            self._blocked[1].cancel()
            self._blocked = None

    def _action_changed(self, event: ActionChanged) -> None:
        action = event.action
        if self._blocked is not None and self._blocked[0] is action and not _waits(action):
            self._unblock()
        for kind in self._rides.of(action):
            self.note(kind, event.stamp)
        if action.name in DRIVES and action.status is ActionStatus.EXECUTING and self._looked != action.id:
            self._looked = action.id
            if stands_in_something(self._robot):
                self.note(GeneralEvent.CURRENT_POSE_OCCUPIED, event.stamp)
        if action.source == PART:
            return  # the errand reports it
        if action.status is ActionStatus.ABORTED and action_word(self._actions.name_of(action)) in HOMING:
            match action.error:
                case DockNotFound():
                    self.note(GeneralEvent.SEARCH_DOCK_FAILED, event.stamp)
                case Unreachable() | Blocked():
                    self.note(GeneralEvent.MOVE_TO_LANDING_POINT_FAILED, event.stamp)


def _same_obstacle(before: PathBlocked, now: PathBlocked) -> bool:
    """Return whether an obstacle was reported already: a scan or two without it do not make it a new one."""
    if now.stamp - before.stamp >= OCCUPIED_AGAIN:
        return False
    return before.at is None or now.at is None or before.at.distance_to(now.at) < SAME_PLACE


def _waits(action: Action) -> bool:
    """Return whether the robot still waits in front of an obstacle."""
    if action.status.ended:
        return False
    return not isinstance(action.feedback, NavigationFeedback) or action.feedback.stage == "waiting"
