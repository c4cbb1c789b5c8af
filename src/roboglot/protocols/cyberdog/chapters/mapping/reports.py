"""Reports of map and surroundings to the app during mapping and navigation: pushes 6001, 6005, 6006, 6011."""

from __future__ import annotations

import asyncio

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.geometry import Path
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.table import push
from roboglot.protocols.cyberdog.vocabulary import grid_of, laser_of, points_of, pose_of
from roboglot.wire.cyberdog.channel import PUSH_MAX
from roboglot.wire.cyberdog.codes import Code, TaskState

MAP = push(Code.MAP, depth=2)
POSE = push(Code.POSE, depth=2)
PATH = push(Code.PATH, depth=2)
LASER = push(Code.LASER, depth=1)
CELLS_MAX = PUSH_MAX // len("0,")  # of a map, so that it fits into a push
PERIOD = 0.2  # s between two poses
MAP_EVERY = 5  # periods between two checks whether the map has grown
MAPPING = frozenset({TaskState.MAPPING, TaskState.OUTDOOR_MAPPING})
WITH_LASER = frozenset(
    {
        TaskState.LOCALIZING,
        TaskState.LOCALIZED,
        TaskState.NAVIGATING,
        TaskState.OUTDOOR_LOCALIZING,
        TaskState.OUTDOOR_LOCALIZED,
        TaskState.OUTDOOR_NAVIGATING,
    }
)
WITH_POSE = WITH_LASER | MAPPING


class MapReports:
    """Periodic reports, only in those states of the task that need them."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self._robot = robot
        self._app = app
        self._state = TaskState.IDLE
        self._revision = -1  # of the map that was last sent to the app
        self._scan_at = -1.0
        self._task: asyncio.Task[None] | None = None

    def follow(self, state: TaskState) -> None:
        """Start or stop reports after a change of the task's state."""
        self._state = state
        if state not in WITH_POSE:
            self.stop()
        elif self._task is None:
            self._revision = -1
            self._task = asyncio.get_running_loop().create_task(self._run(), name="map reports")

    def stop(self) -> None:
        """Stop reports."""
        if self._task:
            self._task.cancel()
            self._task = None

    async def close(self) -> None:
        """Stop reports and wait for the end."""
        task = self._task
        self.stop()
        if task:
            await asyncio.gather(task, return_exceptions=True)

    def forget_app(self) -> None:
        """Forget what the app has received: another app has no map yet."""
        self._revision = -1

    def show_map(self, grid: OccupancyGrid) -> None:
        """Push ``grid`` (6001); not encoded if no app is there."""
        if self._app.connected and grid.width * grid.height <= CELLS_MAX:
            self._app.push(MAP, grid_of(grid))

    def show_path(self, path: Path) -> None:
        """Push the planned path (6006); an empty one clears the app's screen."""
        self._app.push(PATH, {"path_point": points_of(path.points)})

    async def _run(self) -> None:
        beats = 0
        async for _ in self._robot.clock.every(PERIOD):
            if not self._app.connected:
                continue
            if Localization in self._robot:
                self._show_surroundings()
            if beats % MAP_EVERY == 0 and Mapping in self._robot:
                self._show_growth()
            beats += 1

    def _show_surroundings(self) -> None:
        pose = self._robot[Localization].pose
        self._app.push(POSE, pose_of(pose))
        scan = self._robot[Lidar].scan if self._state in WITH_LASER and Lidar in self._robot else None
        if scan and scan.stamp != self._scan_at:
            self._scan_at = scan.stamp
            self._app.push(LASER, {"laser_point": laser_of(scan, pose)})

    def _show_growth(self) -> None:
        """Push the growing map while mapping; when localized, the app has it already."""
        revision = self._robot[Mapping].revision
        if self._revision < 0 or (self._state in MAPPING and revision != self._revision):
            self._revision = revision
            self.show_map(self._robot[Mapping].grid)
