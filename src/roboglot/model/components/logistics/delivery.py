"""Delivery to people: orders, their outcomes, and the policy of the service. Knows no vendor's words."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.model.components.motion.navigation import Tracks
from roboglot.values import dataclass


class OrderKind(StrEnum):
    """Kind of a delivery order, by its purpose at the target."""

    TAKEOUT = "takeout"  # people take their parcels out of boxes, one box after the other
    DISTRIBUTE = "distribute"  # all boxes open; people help themselves
    FOOD = "food"  # people take food from the tray
    RECYCLE = "recycle"  # people put dishes onto the tray
    GUIDE = "guide"  # a person follows the robot
    RETURN = "return"  # go to the place without a task
    STATION = "station"  # a cabinet, the first stop, fills the boxes; continues as TAKEOUT
    ROUND = "round"  # from place to place, with a pause at each
    DISINFECT = "disinfect"
    COLLECT = "collect"  # created by the robot: reception takes back uncollected parcels


class OrderStatus(StrEnum):
    """Status of a delivery order."""

    READY = "ready"
    RUNNING = "running"
    CANCELING = "canceling"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELED = "canceled"

    @property
    def ended(self) -> bool:
        """True once the order has ended, however it ended."""
        return self in (OrderStatus.SUCCEEDED, OrderStatus.FAILED, OrderStatus.CANCELED)


class OrderStage(StrEnum):
    """Current stage of the robot within an order."""

    DRIVING_TO_STOP = "driving to stop"
    AT_STOP = "at stop"  # waits for ``end_operation``
    DRIVING = "driving"
    AT_TARGET = "at target"  # waits for ``start_pickup``, or for ``end_pickup`` where there is no box
    DRIVING_TO_CABINET = "driving to cabinet"
    AT_CABINET = "at cabinet"  # waits until the cabinet has filled the boxes
    HANDING_OVER = "handing over"  # a person is at the boxes


class Failure(StrEnum):
    """Reason for a failed order or box."""

    NOT_TAKEN = "nobody took it"
    DOOR_STUCK = "the door of a box does not move"
    DOOR_OPEN = "something keeps a box's door from closing"
    NO_BOX = "there is no such box"
    NO_PLACE = "there is no such place on the map"
    UNREACHABLE = "no way leads there"
    BLOCKED = "something stood in the way for too long"
    NOT_LOCALIZED = "the robot does not know where it is"
    NO_LIFT = "the lift did not come"
    STOPPED = "stopped for too long"
    INTERRUPTED = "somebody else took the robot"
    DOCK_HELD = "something holds the robot on its dock"
    BATTERY_LOW = "the battery is low"
    NOT_LOADED = "the cabinet put nothing into a box"
    NO_DISINFECTION = "this robot has nothing to disinfect with"
    REFUSED = "the robot refuses to drive"


class Phase(StrEnum):
    """State of the service; details of ``WORKING`` are in the current order's stage."""

    IDLE = "idle"
    WORKING = "working"
    RETURNING = "returning"  # to a parking place
    GOING_HOME = "going home"  # to the dock


class WorkMode(StrEnum):
    """Range of orders that people may give at the robot itself."""

    DISPATCH = "dispatch"  # controlled remotely only
    RECYCLE = "recycle"  # only collects dishes
    MANUAL = "manual"  # accepts any order


@dataclass(frozen=True, slots=True)
class BoxChoice:
    """A box of a compartment."""

    compartment: str
    box: int


@dataclass(frozen=True, slots=True)
class PickUp:
    """Outcome of one box, or of one stop (``box`` None); no ``failure``: success."""

    box: BoxChoice | None = None
    stop: str = ""
    failure: Failure | None = None


@dataclass(frozen=True, slots=True)
class Untaken:
    """Boxes that a failed order left full."""

    target: str
    boxes: tuple[BoxChoice, ...]


@dataclass(frozen=True, slots=True)
class OrderRequest:
    """Request for an order; ``target`` and ``stops`` are display names or ids of places on the map.

    Of a ROUND: ``waits`` (s) at each of ``stops`` and at ``target``, 0: until the operation is ended; ``tasks``:
    free text on the work there. ``remote``: ordered from afar, allowed in every work mode; not with
    a battery below ``level_no_cloud``. ``number``: the order's own number, if it has one already.
    """

    kind: OrderKind
    target: str
    stops: tuple[str, ...] = ()
    boxes: tuple[BoxChoice, ...] = ()
    waits: tuple[float, ...] = ()
    tasks: tuple[str, ...] = ()
    remote: bool = False
    number: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """A request and its outcome; ``changed_at`` in seconds since 1970.

    ``client`` and ``owner``: the one who ordered, and the identity that it proved; empty: the robot itself.
    """

    id: str
    number: str
    request: OrderRequest
    status: OrderStatus = OrderStatus.READY
    stage: OrderStage = OrderStage.DRIVING
    stop: str = ""  # the stop to which the robot is driving or at which it stands
    failure: Failure | None = None
    results: tuple[PickUp, ...] = ()
    untaken: tuple[Untaken, ...] = ()  # for COLLECT: whose parcels these were
    began_at: float = 0.0  # s since 1970; 0 before it began
    changed_at: float = 0.0
    client: str = ""
    owner: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """The service's rules. Seconds; battery levels in percent; speeds in m/s, None: as fast as the robot may."""

    work_mode: WorkMode = WorkMode.MANUAL
    hours: tuple[tuple[int, int], ...] = ()  # [from, to) in seconds of the day, UTC; none: always
    rest_days: tuple[int, ...] = ()  # 0 Sunday … 6 Saturday
    delivery_speed: float | None = None
    return_speed: float | None = None
    speed_ratio: float = 1.0
    tracks: Tracks = Tracks.FREE
    directed: bool = False  # tracks, where they count, from their start to their end only
    tolerance: float = 0.05  # m from the target that count as arrived
    waits: bool = False  # for obstacles that are not on the map, instead of driving around them
    retries: int = 0
    yaw: float | None = None  # rad in map, at every target; None: the heading of the place
    pickup_seconds: float = 300.0
    door_seconds: float = 90.0
    collect_seconds: float = 300.0
    stopped_seconds: float = 300.0
    food_seconds: float = 120.0
    level_off: int = 6
    level_home: int = 10
    level_no_cloud: int = 20
    level_no_takeout: int = 30
    words: Mapping[str, object] = field(default_factory=dict)  # a door's JSON, kept with the object that it describes


class Delivery(Component):
    """Delivery service; carries out orders one after the other. Publishes ``DeliveryReported``.

    Orders and policy survive a crash; an interrupted order starts again, without boxes and stops that have a result.
    """

    @property
    @abstractmethod
    def orders(self) -> Sequence[Order]:
        """Open orders and the last ended ones, oldest first."""

    @property
    @abstractmethod
    def current(self) -> Order | None:
        """The order in progress; None if there is none."""

    @property
    @abstractmethod
    def phase(self) -> Phase:
        """Current state."""

    @property
    @abstractmethod
    def policy(self) -> Policy:
        """Current rules."""

    @abstractmethod
    async def change_policy(self, edit: Callable[[Policy], Policy]) -> None:
        """Replace the rules by ``edit`` of them, after every change under way; return once they are on disk."""

    @abstractmethod
    async def accept(self, *requests: OrderRequest) -> Sequence[Order]:
        """Queue orders, all or none.

        Raises NotFound for an unknown place or box, Refused by the work mode, for a low battery, a box of another order
        or a full queue, and InvalidGoal for a takeout without a box.
        """

    @abstractmethod
    async def cancel(self, id: str | None = None) -> None:
        """Cancel the order of that id or number, or all; the robot brakes. Raises NotFound."""

    @abstractmethod
    async def disown(self, owner: str) -> None:
        """Cancel the orders of an identity that may no longer drive; the robot brakes and stays there."""

    @abstractmethod
    async def finish(self) -> None:
        """End all orders as SUCCEEDED."""

    @property
    @abstractmethod
    def executing(self) -> bool:
        """True if orders are carried out."""

    @abstractmethod
    async def execute(self, on: bool) -> None:
        """Hold the robot (a person is at its screen), or continue; without orders it then goes to rest."""

    @abstractmethod
    def halt(self) -> bool:
        """Hold a robot that has orders, at once; return True if it was not held. ``execute`` stores the hold."""

    @abstractmethod
    async def start_pickup(self) -> None:
        """Report that a person begins to take goods. Raises Refused unless the robot stands at the target."""

    @abstractmethod
    async def end_pickup(self) -> None:
        """Report that the box or tray was emptied; the box closes. Raises Refused unless at the target."""

    @abstractmethod
    async def end_operation(self) -> None:
        """Report that the work at this stop is done. Raises Refused unless the robot stands at a stop."""
