"""View of one robot, shared by all pages: state, scan, map, path, drawings."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.console import drawings, plain_values
from roboglot.console.camera import Sightings
from roboglot.console.frames import map_frame, path_frame, scan_frame
from roboglot.console.settings import MAP_SECONDS
from roboglot.console.state import state_of
from roboglot.console.wire_log import WireLog
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import NavigationFeedback
from roboglot.model.components.system.link import is_current
from roboglot.model.events import ControlRefused, MapReplaced, ScanTaken
from roboglot.model.geometry import Path, Pose
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage

NO_PATH = Path()


class RobotView:
    """View of one robot. ``scan``, ``map`` and ``path`` are the newest messages, None before the first."""

    def __init__(self, robot: Robot, stage: Stage) -> None:
        self.robot, self._stage = robot, stage
        self.wire = WireLog(robot)
        self.sightings = Sightings(robot)
        self._looking = 0
        self.scan: bytes | None = None
        self.map: bytes | None = None
        self.path: bytes = path_frame(robot.id, NO_PATH)
        self.refusals: list[dict[str, str]] = []  # refusals to other clients, newest last
        self.anchor: Pose | None = None
        self._path = NO_PATH
        self._revision = -1
        self._map_at = -MAP_SECONDS
        self._packing: asyncio.Task[None] | None = None
        self._viewers = 0
        self._leaving: list[Callable[[], None]] = []
        self._state: dict[str, object] = {}
        self._state_beat = -1
        self._replaced = robot.events.listen(MapReplaced, lambda _: self.settle())

    def settle(self) -> None:
        """Determine a new map's pose in the world."""
        self.anchor = drawings.anchor_of(self.robot, self._stage)

    def open(self) -> None:
        """Add a page that shows this robot."""
        self._viewers += 1
        if self._viewers == 1:
            listen = self.robot.events.listen
            self._leaving = [listen(ScanTaken, self._note_scan), listen(ControlRefused, self._note_refusal)]

    def close(self) -> None:
        """Remove a page that showed this robot."""
        self._viewers -= 1
        if not self._viewers:
            self._let_go()

    def start_looking(self) -> None:
        """Add a page that shows the camera's detections."""
        self._looking += 1
        self.sightings.open()

    def stop_looking(self) -> None:
        """Remove a page that showed the camera's detections."""
        self._looking -= 1
        if not self._looking:
            self.sightings.close()

    def end(self) -> None:
        """End the view with the console."""
        self.sightings.close()
        self._replaced()
        self._let_go()
        self.wire.end()
        if self._packing is not None:
            self._packing.cancel()

    def _let_go(self) -> None:
        for leave in self._leaving:
            leave()
        self._leaving = []

    @property
    def watched(self) -> bool:
        """True if a page shows this robot."""
        return self._viewers > 0

    @property
    def motion(self) -> list[float | None]:
        """[x, y, yaw, forward m/s, left m/s, rad/s] now, in the robot's map; all None while the pose is unknown.

        The rates are None while the robot has no link: only where it was is known.
        """
        robot = self.robot
        where = drawings.whereabouts(robot)
        if where is None:
            return [None] * 6
        if not is_current(robot):
            return [*plain_values.pose(where), None, None, None]
        speed = robot[Base].velocity if Base in robot else None
        rates = [plain_values.number(v) for v in (speed.x, speed.y, speed.yaw)] if speed else [0.0, 0.0, 0.0]
        return [*plain_values.pose(where), *rates]

    def state(self) -> dict[str, object]:
        """Return the slowly changing state, by key."""
        return state_of(self.robot) | {
            "drawings": drawings.drawings_of(self.robot),
            "anchor": plain_values.pose(self.anchor) if self.anchor else None,
            "refused": self.refusals[-1] if self.refusals else None,
        }

    def state_at(self, beat: int) -> dict[str, object]:
        """Return the state, read once per beat for all pages."""
        if self._state_beat != beat:
            self._state_beat, self._state = beat, self.state()
        return self._state

    def look(self, now: float) -> None:
        """Update path and map if they have changed; ``now``: the machine's time, s."""
        path = next((p for a in self.robot.actions.running() if (p := _path_of(a.feedback)) is not None), NO_PATH)
        if path is not self._path:
            self._path, self.path = path, path_frame(self.robot.id, path)
        if Mapping in self.robot and self._packing is None and now - self._map_at >= MAP_SECONDS:
            revision = self.robot[Mapping].revision
            if revision != self._revision:
                self._revision, self._map_at = revision, now
                self._packing = asyncio.get_running_loop().create_task(self._pack(revision), name="console map")

    async def _pack(self, revision: int) -> None:
        """Deflate the map in a thread: a large one takes 10 ms."""
        grid = self.robot[Mapping].grid
        grid = type(grid)(grid.log_odds.copy(), grid.resolution, grid.origin)
        try:
            self.map = await asyncio.to_thread(map_frame, self.robot.id, revision, grid)
        finally:
            self._packing = None

    def _note_scan(self, event: ScanTaken) -> None:
        where = drawings.whereabouts(self.robot) or Pose()
        self.scan = scan_frame(self.robot.id, event.scan, where)

    def _note_refusal(self, event: ControlRefused) -> None:
        self.refusals = [*self.refusals[-4:], {"client": event.client, "doing": event.doing, "reason": event.reason}]


def _path_of(feedback: object) -> Path | None:
    return feedback.remaining if isinstance(feedback, NavigationFeedback) else None
