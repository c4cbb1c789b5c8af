"""The robot's two maps: the one in memory, which it uses and changes, and the one on disk, which survives restarts.

In memory are the grid, places and annotations. The file on disk is stored unchanged, and loaded when the robot starts
or on request. Multi-floor operations use the floors, places and docks that were loaded last.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import logging
from collections.abc import Callable, Coroutine, Sequence
from dataclasses import replace

from roboglot.confirmation import confirmed
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import MOVED, Drawings, MapMemory, Replacement, exchange, moved
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, NotFound, Refused, RobotError
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.artifact.drawing import seen_from
from roboglot.protocols.slamware.chapters.artifact.poi_shifts import PoiShifts
from roboglot.protocols.slamware.chapters.cloud import CloudFolder
from roboglot.protocols.slamware.chapters.motion.home_docks import BOUND, before, home_dock, known_docks, settle_home
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName, composite_of, floors_of
from roboglot.protocols.slamware.chapters.slam.last_place import PlaceMemory, is_docked, last_place
from roboglot.protocols.slamware.chapters.slam.loaded_floors import LoadedFloors
from roboglot.protocols.slamware.chapters.slam.map_frames import (
    BASIS,
    DRAWN,
    FLOOR,
    NO_FLOOR,
    NOT_MOVED,
    bases,
    encoded,
    frame_on_disk,
    other_drawings,
    put_aside,
    put_drawings,
    replacement,
    with_docks,
)
from roboglot.protocols.slamware.chapters.slam.map_start import MapStart
from roboglot.protocols.slamware.chapters.slam.resuming import resumed
from roboglot.wire.slamware.chapters.multi_floor import MapLoadStatus
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap
from roboglot.wire.slamware.chapters.slam.stcm import Layer, decode_stcm, encode_stcm

log = logging.getLogger(__name__)
FILE = "slamware/map.stcm"
NO_GRID = "the map has no grid"


def _go_on() -> None:
    """Stop nothing."""


class MapKeeper:
    """Map keeper of one robot; changes of its maps, in memory and on disk, are made one after the other."""

    def __init__(self, robot: Robot, cloud: CloudFolder, shifts: PoiShifts, synced: Callable[[], None]) -> None:
        self._robot, self._cloud, self._shifts, self._synced = robot, cloud, shifts, synced
        self._turn, self._parsing = asyncio.Lock(), asyncio.Lock()
        self._loading = False
        self._layers: tuple[Layer, ...] = ()  # of the map in memory, of unknown type
        self.status = MapLoadStatus.NOT_LOADED
        self.starting = MapStart(self.start)
        self._loaded = LoadedFloors()
        self.current = FloorName()
        self.entered: Callable[[], None] = lambda: None  # called when another floor is in use
        self.place = PlaceMemory(robot, lambda: frame_on_disk(robot))

    @property
    def floors(self) -> tuple[FloorMap, ...]:
        """Floors loaded from disk; the one in memory as seen from its present origin."""
        return self._loaded.shown

    @property
    def start_floor(self) -> FloorMap | None:
        """Floor of the bound dock, else the loaded file's default one."""
        return _start_of(self._robot, self.floors) if self.floors else None

    async def start(self) -> None:
        """Load the map on disk, if there is one and the robot can map, and begin to store its place on it.

        Without one, the entered docks remain, and with them the robot's home.
        """
        if Mapping not in self._robot or FileStore not in self._robot:
            return
        if MapMemory in self._robot:
            memory = self._robot[MapMemory]
            await memory.settle()  # the restart of the robot cleared the map
            memory.mover = self._on_origin_moved
            if (since := moved(self._robot)) != ORIGIN:  # while this door was closed
                await self._on_map_cleared(ORIGIN, since)
        try:
            await self.reload(restarting=True)
        except NotFound:
            if Docking in self._robot and self._robot[MapAnnotations].current.docks:
                settle_home(self._robot)
        except RobotError as error:
            log.warning("cannot load the saved map of robot %s: %s", self._robot.id, error)
        self.place.start()

    async def close(self) -> None:
        """Leave the drawings to the robot, and store its place a last time."""
        if MapMemory in self._robot:
            await self._robot[MapMemory].close()
        await self.place.close()

    @property
    def ready(self) -> bool:
        """True if maps can be used, of one floor or several."""
        needed = (Mapping, FileStore, Places, MapAnnotations)
        return all(part in self._robot for part in needed) and self.status is not MapLoadStatus.LOADING

    def export(self) -> bytes:
        """Return the map in memory as a composite map. Refused while a map is being loaded."""
        if self._loading:
            raise Refused("a map is being loaded")
        robot = self._robot
        annotations = replace(robot[MapAnnotations].current, docks=known_docks(robot))
        floor = FloorMap(self.current, robot[Mapping].grid, annotations, tuple(robot[Places].all()), self._layers)
        try:
            return encode_stcm(composite_of(floor))
        except BadMap as error:
            raise InvalidGoal(str(error)) from None

    async def use(self, data: bytes, pose: Pose, *, stop: Callable[[], None]) -> None:
        """Use the map of a file's start floor from now on, in memory only, after calling ``stop``."""
        floor = _start_of(self._robot, await self._parse(data))
        async with self._turn:
            await self._robot[MapMemory].check_store()
            draw = put_drawings(self._robot, floor, {})  # the present drawings belong to no file
            await self._use(floor, pose, draw, stop)

    async def upload(self, data: bytes) -> None:
        """Store the file on disk unchanged, without loading it. Raises InvalidGoal unless it could be loaded."""
        _require_usable(await self._parse(data))
        async with self._turn:
            await self._robot[FileStore].write(FILE, data)

    async def delete(self) -> None:
        """Delete the file, if there is one; the map in memory stays."""
        async with self._turn:
            with contextlib.suppress(NotFound):
                await self._robot[FileStore].remove(FILE)

    async def save(self) -> None:
        """Save the map in memory to disk. Refused if the file has several floors, as the others would be lost."""
        async with self._turn:
            with contextlib.suppress(NotFound, InvalidGoal):  # no map, or one that no start could load
                if (floors := len(await self._parse(await self._robot[FileStore].read(FILE)))) > 1:
                    raise Refused(f"the saved map has {floors} floors, but only one is in memory")
            data = self.export()
            digest, floor = _digest(data), self.current.map_id
            settings = {BASIS: {digest: NOT_MOVED}, FLOOR: floor} | self._shifts.settings(digest, floor)

            def edit(now: Drawings) -> Replacement:
                docks = known_docks(self._robot)  # as in the file, including the robot's own
                return Replacement(with_docks(now, docks), settings, {FILE: data, DRAWN: None})

            await self._robot[MapMemory].replace(edit)
            self.place.known = True

    async def sync(self) -> None:
        """Save and reload; the grid in memory stays, as it is the same."""
        await self.save()
        data = await self._robot[FileStore].read(FILE)
        self._loaded.hold(await self._parse(data), _digest(data))
        self.status = MapLoadStatus.LOADED

    async def reload(
        self, pose: Pose | None = None, *, restarting: bool = False, stop: Callable[[], None] = _go_on
    ) -> None:
        """Load the map from disk, after replacing it by the cloud's, if there is one. Raises NotFound without a map.

        Without ``pose`` the robot is taken to stand on its dock or in front of it. ``restarting``: keep drawings made
        on that same map since it was saved, and continue at the last place on it. ``stop`` is called before a map is
        used, and not if there is none.
        """
        async with self._turn:
            if not restarting:  # a start with a full disk still has the grid
                await self._robot[MapMemory].check_store()
            before, self.status = self.status, MapLoadStatus.LOADING
            try:
                await self._fetch()
                data = await self._robot[FileStore].read(FILE)
                floors, digest = await self._parse(data), _digest(data)
                floor = _start_of(self._robot, floors)
                if restarting:
                    last = self.place.here() or last_place(self._robot)
                    floor, pose = resumed(self._robot, floors, digest, last) or (floor, None)
                keep = restarting and digest in bases(self._robot)
                draw = self._turn_over(floor, digest) if keep else put_drawings(self._robot, floor, {digest: NOT_MOVED})
                await self._use(floor, pose, draw, stop)
            except NotFound:
                self.status = before
                raise
            except BaseException:
                self.status = MapLoadStatus.ERROR
                raise
            self._loaded.hold(floors, digest)
            self.entered()
            self._shifts.load(digest, floor.name.map_id)
            self.status = MapLoadStatus.LOADED

    async def _fetch(self) -> None:
        """Store the cloud's map on disk, if it differs."""
        data = self._cloud.map()
        if data is None:
            return
        files = self._robot[FileStore]
        with contextlib.suppress(NotFound):
            if data == await files.read(FILE):
                return
        try:
            _require_usable(await self._parse(data))
        except InvalidGoal as error:
            log.warning("cannot read the cloud's map: %s", error)
            return
        await files.write(FILE, data)
        self._synced()

    async def enter(self, building: str, floor: str, pose: Pose | None, *, stop: Callable[[], None] = _go_on) -> None:
        """Use the map of another loaded floor, with its last drawings, after calling ``stop``. Raises NotFound."""
        if (loaded := self._loaded.find(building, floor)) is not None:
            async with self._turn:
                await self._robot[MapMemory].check_store()
                await self._use(loaded, pose, self._turn_over(loaded, self._loaded.digest), stop)
            return
        raise NotFound(f"no floor {floor!r} of {building!r} is loaded")

    async def leave_floors(self, stop: str, drawn: Drawings) -> None:
        """Put the floor's drawings aside: the robot is at the lift's ``stop``, whose map has no more than ``drawn``."""
        async with self._turn:
            others, basis = await other_drawings(self._robot), bases(self._robot)

            def edit(now: Drawings) -> Replacement:
                for shift in basis.values():
                    put_aside(self._robot, now, shift, others, self.current.map_id)
                return Replacement(drawn, {FLOOR: NO_FLOOR}, {DRAWN: encoded(others)})

            await self._robot[MapMemory].replace(edit)
            self._layers, self.current = (), FloorName(self.current.building, stop, default=False)
            self._loaded.restore()

    async def _parse(self, data: bytes) -> list[FloorMap]:
        """Return the floors in a file, in a thread: a hostile file may take seconds, and 300 MB; so one at a time."""
        if isinstance(self._robot.clock, LockstepClock):
            return _parsed(data)
        async with self._parsing:
            return await asyncio.to_thread(_parsed, data)

    async def _use(
        self, floor: FloorMap, pose: Pose | None, draw: Coroutine[object, None, None], stop: Callable[[], None] = _go_on
    ) -> None:
        """Load the grid into memory, call ``draw`` for its drawings, and set the robot's pose, else at its dock."""
        self._loading = True
        try:
            if floor.grid is None:
                raise InvalidGoal(NO_GRID)
            floor.annotations.check_limits(self._robot[MapAnnotations].current)
            stop()
            with exchange(self._robot):
                async with confirmed():
                    self._robot[Mapping].load(floor.grid, pose or ORIGIN)
                await draw
        finally:
            draw.close()
            self._loading = False
        self.place.known = True
        if Docking in self._robot:
            settle_home(self._robot)
        self._layers, self.current = floor.layers, floor.name
        self._loaded.restore()
        self.entered()
        if pose is None and Docking in self._robot and (dock := home_dock(self._robot)) is not None:
            _take_place_at(dock, self._robot)
        self.place.keep_soon()

    async def clear(self) -> None:
        """Clear the map and begin a new one where the robot is; return once the drawings are on it."""
        origin, memory = self._robot[Localization].pose, self._robot[MapMemory]
        await memory.check_store()
        with memory.exchange():
            async with confirmed():  # the drawings stay where a real robot refuses
                with memory.left_to_caller():
                    self._robot[Mapping].clear()
            await self._on_map_cleared(origin)

    async def _on_origin_moved(self, origin: Pose) -> None:
        """Handle a change of the map by another door."""
        if self._robot[Mapping].grid.width and origin.yaw == 0.0:
            await self._shift(origin)
        else:
            await self._on_map_cleared(origin)

    async def _on_map_cleared(self, origin: Pose, since: Pose = ORIGIN) -> None:
        """Handle the clearing of memory's grid: its origin is now at ``origin``, from which drawings are given.

        The manual clears the map only, and has operations of its own for each kind of drawing. Further drawings
        belong to no floor of the file: a restart restores the file's grid with the drawings that it has now.
        ``since``: to which the origin, and all drawings, have been moved already.
        """
        async with self._turn:
            others, basis = await other_drawings(self._robot), bases(self._robot)

            def edit(now: Drawings) -> Replacement:
                for shift in basis.values():
                    put_aside(self._robot, seen_from(since.inverse(), now), shift, others, self.current.map_id)
                settings = {FLOOR: NO_FLOOR, MOVED: ()}
                return Replacement(seen_from(origin, now), settings, {DRAWN: encoded(others)})

            await self._robot[MapMemory].replace(edit)
            self._layers = ()
            self._loaded.move(self.current, origin, bases(self._robot))

    async def move_origin(self, point: Point) -> None:
        """Move the origin of the map in memory to ``point``, by whole cells; drawings keep their places."""
        memory = self._robot[MapMemory]
        await memory.check_store()
        with memory.exchange():
            async with confirmed():
                with memory.left_to_caller():
                    origin = self._robot[Mapping].move_origin(point)
            await self._shift(Pose(origin.x, origin.y))

    async def _shift(self, origin: Pose) -> None:
        """Handle a move of the origin of memory's grid to ``origin``."""
        async with self._turn:
            basis = {digest: (x + origin.x, y + origin.y) for digest, (x, y) in bases(self._robot).items()}
            await self._robot[MapMemory].replace(
                lambda now: Replacement(seen_from(origin, now), settings={BASIS: basis})
            )
            self._layers = ()
            self._loaded.move(self.current, origin, basis)

    async def _turn_over(self, floor: FloorMap, digest: str) -> None:
        """Switch from the floor in memory to ``floor`` of the map with ``digest``, each with its drawings."""
        if digest not in bases(self._robot):  # memory holds another map
            await put_drawings(self._robot, floor, {digest: NOT_MOVED})
            return
        others, shift = await other_drawings(self._robot), bases(self._robot)[digest]

        def turn(now: Drawings) -> Replacement:
            put_aside(self._robot, now, shift, others, self.current.map_id)
            return replacement(floor, {digest: NOT_MOVED}, others)

        await self._robot[MapMemory].replace(turn)


def _start_of(robot: Robot, floors: Sequence[FloorMap]) -> FloorMap:
    """Return the floor of the bound dock, else the default one."""
    bound = robot[Settings].get(BOUND)
    return max(floors, key=lambda f: (bound in {dock.id for dock in f.annotations.docks}, f.name.default))


def _take_place_at(dock: PointOfInterest, robot: Robot) -> None:
    """Take the robot to be on its dock or in front of it; at the map's origin if a file has the dock off any map."""
    try:
        robot[Localization].set_pose(dock.pose if is_docked(robot) else before(dock))
    except InvalidGoal as error:
        log.warning("the home dock of robot %s cannot be its place: %s", robot.id, error)


def _require_usable(floors: Sequence[FloorMap]) -> None:
    """Raise InvalidGoal for a floor that could not be loaded."""
    for floor in floors:
        floor.annotations.check_limits()
        if floor.grid is None:
            raise InvalidGoal(f"floor {floor.name.floor} of the map has no grid" if floor.name.floor else NO_GRID)


def _parsed(data: bytes) -> list[FloorMap]:
    try:
        return floors_of(decode_stcm(data))
    except BadMap as error:
        raise InvalidGoal(f"not a composite map: {error}") from None


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
