"""Doors: the value that describes one (``DoorType``), the site that it is opened at, and the open door."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import tzinfo
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.config import Config
    from roboglot.model.robot import Robot
    from roboglot.operations import OperationTable
    from roboglot.programs.tasks.service import ProgramService
    from roboglot.transport.tls import Tls
    from roboglot.wire.contracts import Row
    from roboglot.wire.visual.cloud import CloudAnswer
    from roboglot.wire.visual.relay import FrameRelay


@dataclass(frozen=True, slots=True)
class Endpoint:
    """One address of a door for the start screen, with a line to copy that tries it (empty: none).

    ``certificates``: the folder of a client's certificates where it takes some.
    """

    label: str
    address: str
    try_line: str = ""
    certificates: Path | None = None


class Door(Protocol):
    """Listens from the end of ``start`` to ``close``; both are called once, on the running loop."""

    @property
    def name(self) -> str:
        """The door's name, as in ``DoorType``."""

    async def start(self) -> None:
        """Bind and listen; raises OSError naming the address that is taken."""

    async def close(self) -> None:
        """Stop listening and end what clients began; within a second."""

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """Addresses that the door listens at, after ``start``."""


@dataclass(frozen=True, slots=True)
class ClosedDoor:
    """Door that the configuration keeps closed; its server is not loaded."""

    name: str

    async def start(self) -> None:
        """Open nothing."""

    async def close(self) -> None:
        """Do nothing."""

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """Return no endpoints: the door is closed."""
        return ()


class CloudLink(Protocol):
    """Connection to a cloud that stores programs."""

    async def post(self, frame: str) -> CloudAnswer:
        """Send one frame and return its answer; raises ``Clouds.failures`` where none came."""


class Outbox(Protocol):
    """Ordered queue of documents to send; survives a crash."""

    async def put(self, document: str) -> None:
        """Append a document. Raises StoreError (`roboglot.programs.errors`)."""

    async def first(self) -> tuple[int, str] | None:
        """Return the oldest document with its number, or None."""

    async def remove(self, number: int) -> None:
        """Delete a document that was sent, or given up."""


@dataclass(frozen=True, slots=True)
class Clouds:
    """Access to clouds, by address and an account's token; ``outbox`` keeps what could not be sent yet."""

    link: Callable[[str, str], CloudLink]
    failures: type[Exception]
    outbox: Outbox


@dataclass(slots=True)
class Site:
    """Arguments for opening a door: one robot, the address to listen at, and the parts that a program's doors share.

    ``programs`` makes the service for block programs in a time zone; its flag demands that the kernel filters system
    calls. ``tls``: how ports that can encrypt do so. ``frames`` takes programs' frames; a door that has ``provides``
    sets it for the others. ``people``: the folder with the list of people, if it is another than ``data``.
    """

    robot: Robot
    address: str
    data: Path
    programs: Callable[[tzinfo, bool], ProgramService]
    clouds: Clouds
    tls: Tls | None = None
    frames: FrameRelay | None = None
    people: Path | None = None


class PortKind(Enum):
    """TCP: the robot listens. PUSH and BROADCAST: clients take datagrams. APP: the app listens, and the robot dials.

    ROUTER: the robot listens, without saying whose clients come. BROKER: a server of the site, which the robot dials.
    Tunnels carry neither of these two.
    """

    TCP = auto()
    PUSH = auto()
    BROADCAST = auto()
    APP = auto()
    ROUTER = auto()
    BROKER = auto()


@dataclass(frozen=True, slots=True)
class PortSetting:
    """A port of the protocol: its label, and the setting that holds its number."""

    label: str
    setting: str
    kind: PortKind = PortKind.TCP


@dataclass(frozen=True, slots=True)
class Option:
    """An option of ``roboglot up`` that sets one value of the door's section; without ``value`` it takes a text."""

    flag: str
    setting: str
    help: str
    value: object = None


class Implementation(Protocol):
    """Implemented rows of a contract; a module that has these functions is one."""

    def implemented(self) -> set[str]:
        """Return the keys of complete rows."""

    def partly(self) -> dict[str, str]:
        """Return the keys of partial rows, with what they cannot do yet."""


class Chapters(Implementation, Protocol):
    """Handlers of a door: its module ``table``, once the chapters that fill it are imported."""

    @property
    def TABLE(self) -> OperationTable[str] | OperationTable[int]:  # noqa: N802 - a module's constant
        """Operations that clients may ask for."""


@dataclass(frozen=True, slots=True)
class Contract:
    """Rows of the protocol, their implementation, and further paragraphs for the coverage page."""

    name: str
    rows: Callable[[], Sequence[Row]]
    implementation: Callable[[], Implementation]
    notes: Callable[[], Sequence[str]] = tuple


@dataclass(frozen=True, slots=True)
class DoorType:
    """A vendor's protocol as roboglot knows it. Nothing heavy is loaded before one of its functions is called.

    ``config`` is the type of its section in the configuration, a dataclass whose defaults suffice. ``contracts`` are
    the yardsticks of coverage; the first one's keys are those of ``table``, the operations that clients may ask for.
    ``provides``: it sets parts of the site that other doors use, so it is opened first. ``credentials``: those that it
    demands of every client by itself; empty: none.
    """

    name: str
    title: str
    config: type
    contracts: tuple[Contract, ...]
    table: Callable[[], OperationTable[str] | OperationTable[int]]
    ports: tuple[PortSetting, ...]
    open: Callable[[Any, Site], Door]
    options: tuple[Option, ...] = ()
    provides: bool = False
    credentials: str = ""

    def section(self, config: Config) -> object:
        """Return the door's own settings, the defaults where the configuration has no such section."""
        return config.doors.get(self.name) or self.config()

    def listens(self, config: Config) -> bool:
        """Return whether clients reach it at a robot's address."""
        reached = any(port.kind in (PortKind.TCP, PortKind.ROUTER) for port in self.ports)
        return reached and bool(getattr(self.section(config), "enabled", True))

    def port_numbers(self, config: Config, kind: PortKind = PortKind.TCP) -> dict[str, int]:
        """Return the ports of this kind by their labels."""
        section = self.section(config)
        return {port.label: getattr(section, port.setting) for port in self.ports if port.kind is kind}
