"""Contents of the map in use beside its grid, replaced atomically: a crash leaves the old or the new.

They stay where they are in the world: when a map begins or continues at another origin, they move to the new one.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from abc import abstractmethod
from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import field, replace
from functools import partial

from roboglot.model.components.component import Component
from roboglot.model.components.mapping.annotations import Annotations, Line
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import RobotError
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.values import dataclass

log = logging.getLogger(__name__)
MOVED = "map.moved"  # the setting that holds by how much ``move`` has moved the drawings: m, m, rad


@dataclass(frozen=True, slots=True)
class Drawings:
    """Points of interest and annotations of one map."""

    places: Sequence[PointOfInterest]
    annotations: Annotations

    def seen_from(self, origin: Pose) -> Drawings:
        """Return them in the map's frame after its origin has moved to ``origin``; metadata stay as they are."""

        def point(p: Point) -> Point:
            return Pose(p.x, p.y).relative_to(origin).point

        def marks(all: Sequence[PointOfInterest]) -> tuple[PointOfInterest, ...]:
            return tuple(replace(mark, pose=mark.pose.relative_to(origin)) for mark in all)

        def moved(line: Line) -> Line:
            control = (point(line.control[0]), point(line.control[1])) if line.control else None
            return replace(line, start=point(line.start), end=point(line.end), control=control)

        notes = self.annotations
        annotations = replace(
            notes,
            lines=tuple(map(moved, notes.lines)),
            areas=tuple(replace(area, start=point(area.start), end=point(area.end)) for area in notes.areas),
            docks=marks(notes.docks),
            landmarks=marks(notes.landmarks),
        )
        return Drawings(marks(self.places), annotations)


@dataclass(frozen=True, slots=True)
class Replacement:
    """The new drawings, and settings and files that go with them (None: no such file)."""

    drawings: Drawings
    settings: Mapping[str, object] = field(default_factory=dict)
    files: Mapping[str, bytes | None] = field(default_factory=dict)


class MapMemory(Component):
    """Over ``Places``, ``MapAnnotations``, ``Settings`` and ``FileStore``, which show the new state afterwards.

    ``mover`` moves the drawings to a new origin: ``move``, or that of a door which stores more along with them.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.mover: Callable[[Pose], Coroutine[object, None, None]] = self.move
        self._moving: asyncio.Task[None] | None = None  # the last one
        self._left_to_caller = False
        self._holds = 0
        self._released = asyncio.Event()
        robot.events.listen(MapReplaced, self._replaced)

    @abstractmethod
    async def replace(self, edit: Callable[[Drawings], Replacement]) -> None:
        """Replace the current drawings by ``edit`` of them, atomically.

        Returns once all is on disk. Raises InvalidGoal beyond the components' limits, and then nothing changes. Ids of
        annotations are never reused.
        """

    @abstractmethod
    async def check_store(self) -> None:
        """Raise what storing drawings raises now: on a full disk, no map is changed whose drawings could not follow."""

    async def move(self, origin: Pose) -> None:
        """Move the drawings to the map's new ``origin``, and store by how much in all."""

        def edit(now: Drawings) -> Replacement:
            new = moved(self._robot).compose(origin)
            return Replacement(now.seen_from(origin), {MOVED: (new.x, new.y, new.yaw)})

        await self.replace(edit)

    @property
    def settled(self) -> bool:
        """True if drawings and grid belong together; False while drawings are about to be moved or exchanged."""
        return not self._holds

    async def settle(self) -> None:
        """Wait until drawings and grid belong together."""
        while self._holds:
            await self._released.wait()

    async def close(self) -> None:
        """Wait for moves under way, and leave further ones to ``move``."""
        self.mover = self.move
        if self._moving is not None:
            await asyncio.wait([self._moving])

    @contextmanager
    def exchange(self) -> Iterator[None]:
        """Have others wait in ``settle`` while grid and drawings are exchanged.

        Planning waits, too: a plan made inside would wait for itself.
        """
        self._holds += 1
        self._released.clear()
        try:
            yield
        finally:
            self._holds -= 1
            if not self._holds:
                self._released.set()

    @contextmanager
    def left_to_caller(self) -> Iterator[None]:
        """Leave the drawings to the caller, who changes the map meanwhile."""
        self._left_to_caller = True
        try:
            yield
        finally:
            self._left_to_caller = False

    def _replaced(self, event: MapReplaced) -> None:
        if event.origin in (None, ORIGIN) or self._left_to_caller:
            return
        waiting = contextlib.ExitStack()
        waiting.enter_context(self.exchange())
        self._moving = asyncio.get_running_loop().create_task(self.mover(event.origin), name="moving drawings")
        self._moving.add_done_callback(partial(self._end_move, waiting))

    def _end_move(self, waiting: contextlib.ExitStack, move: asyncio.Task[None]) -> None:
        waiting.close()
        if move.cancelled() or (error := move.exception()) is None:
            return
        if not isinstance(error, RobotError):
            raise error
        log.warning("cannot move the drawings of robot %s to the new map: %s", self._robot.id, error)


def moved(robot: Robot) -> Pose:
    """Return the origin to which ``MapMemory.move`` has moved the drawings in all, in their former frame."""
    return Pose(*robot[Settings].get(MOVED, ()))


async def check_store(robot: Robot) -> None:
    """Raise what storing the drawings raises now, if the robot has any."""
    if MapMemory in robot:
        await robot[MapMemory].check_store()


def exchange(robot: Robot) -> AbstractContextManager[None]:
    """Return ``MapMemory.exchange``, or nothing for a robot without drawings."""
    return robot[MapMemory].exchange() if MapMemory in robot else contextlib.nullcontext()


def is_settled(robot: Robot) -> bool:
    """Return whether the robot's drawings, if it has any, and its grid belong together."""
    return MapMemory not in robot or robot[MapMemory].settled


async def settle(robot: Robot) -> None:
    """Wait until the robot's drawings, if it has any, and its grid belong together."""
    if MapMemory in robot:
        await robot[MapMemory].settle()
