"""Maps that fleet control can name: those stored on the robot, and the one in use."""

from __future__ import annotations

from roboglot.confirmation import confirmed
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import NotFound
from roboglot.model.events.mapping import MapReplaced
from roboglot.model.geometry import Pose
from roboglot.model.map_loading import known_dock, load_map
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot

LOOK_PERIOD = 2.0  # s of robot time: maximum age of the list of stored maps


class Maps:
    """Maps of one robot. ``own`` is the mapId of a map that it made itself or that another client loaded.

    On the lift's second floor that is ``own``-1, and so on: each floor has a map.
    """

    def __init__(self, robot: Robot, own: str) -> None:
        self._robot, self._own = robot, own
        self._used: str | None = None  # the stored map in use
        self._names: tuple[str, ...] = ()
        self._looked_at = float("-inf")
        self._loads = 0  # our own loads whose MapReplaced is still to come

    @property
    def in_use(self) -> str:
        """Id of the map in use."""
        if self._used is not None:
            return self._used
        floor = self._robot[Floors].current if Floors in self._robot else 0
        return f"{self._own}-{floor}" if floor else self._own

    async def look(self) -> None:
        """Read the names of the stored maps, if the last time is long ago."""
        now = self._robot.clock.time()
        if MapLibrary in self._robot and now - self._looked_at >= LOOK_PERIOD:
            self._looked_at = now
            self._names = tuple(await self._robot[MapLibrary].names())

    async def follow(self) -> None:
        """Track, without end, changes of the map by other clients."""
        with self._robot.events.subscribe(MapReplaced) as replaced:
            while True:
                event = await replaced.next()
                if self._loads:
                    self._loads -= 1
                elif event.origin is None:
                    self._used = None

    async def kept(self, name: str, version: str) -> StoredMap:
        """Return a stored map. Raises NotFound, also for any version: one map is stored under each name."""
        if version:
            raise NotFound(f"there is no version {version!r}: maps here have none, mapVersion is empty")
        return await self._robot[MapLibrary].get(name)

    async def use(self, stored: StoredMap, pose: Pose) -> None:
        """Use a map from now on, with the robot at ``pose`` in it. Raises the errors of ``Mapping.load``."""
        await self._load(stored, pose)
        self._used = stored.name

    async def change(self, stored: StoredMap) -> None:
        """Use a map and localize the robot in it; if that fails, keep the map in use and raise the reason."""
        robot = self._robot
        grid, pose = robot[Mapping].grid, robot[Localization].pose
        copied = OccupancyGrid(grid.log_odds.copy(), grid.resolution, grid.origin)
        before = StoredMap(self.in_use, copied, 0.0, dock=known_dock(robot))
        await self._load(stored, pose)
        try:
            action = robot[Localization].relocalize(source="vda5050")
            try:
                await action.succeeded()
            finally:
                action.cancel("fleet control cancelled it")
        except BaseException:
            await self._load(before, pose)
            raise
        self._used = stored.name

    async def remove(self, name: str) -> None:
        """Delete a stored map. Raises NotFound."""
        await self._robot[MapLibrary].remove(name)
        self._looked_at = float("-inf")

    def listed(self) -> dict[str, object]:
        """Return the state's ``maps``; nothing for a robot that stores none."""
        if MapLibrary not in self._robot:
            return {}
        names = dict.fromkeys((self.in_use, *self._names))
        states = {name: "ENABLED" if name == self.in_use else "DISABLED" for name in names}
        return {"maps": [{"mapId": name, "mapVersion": "", "mapStatus": status} for name, status in states.items()]}

    async def _load(self, stored: StoredMap, pose: Pose) -> None:
        self._loads += 1
        try:
            async with confirmed():
                load_map(self._robot, stored, pose)
        except BaseException:
            self._loads -= 1
            raise
