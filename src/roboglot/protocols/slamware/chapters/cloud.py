"""A cloud that manages the robot, simulated by a folder: ``map.stcm``, ``voice.json`` and ``tasks/*.json``.

The vendor's cloud protocol is not public; the folder stands in for it, so that all that depends on a cloud can be
tried. It is out of reach while the robot has no internet. Without a folder no cloud manages the robot.
"""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

import msgspec

from roboglot.model.components.logistics.delivery import Delivery, OrderKind, OrderRequest
from roboglot.model.components.system.network import Network
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, RobotError
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.delivery.vocabulary import KINDS, boxes_of
from roboglot.validation import decode_json, why_invalid
from roboglot.wire.slamware.chapters.cloud import CloudTask
from roboglot.wire.slamware.chapters.delivery import VoicePackage

log = logging.getLogger(__name__)
UNBOUND = "slamware.unbound"  # the setting that records that the robot left its cloud
LOOK = 5.0  # s between two checks for tasks
TASKS_MAX, TASK_MAX = 20, 64 << 10  # files per check; bytes per file
VOICE_MAX, MAP_MAX = 1 << 20, 64 << 20  # bytes
CLOUD_KINDS = {**KINDS, "STATION_TAKEOUT": OrderKind.STATION, "DISINFECT": OrderKind.DISINFECT}


class CloudFolder:
    """Cloud folder of one robot."""

    def __init__(self, robot: Robot, folder: str) -> None:
        self._robot = robot
        self._folder = Path(folder) / robot.id if folder else None
        self._looking: asyncio.Task[None] | None = None

    @property
    def managed(self) -> bool:
        """True if a cloud manages the robot."""
        return self._folder is not None and not self._robot[Settings].get(UNBOUND, False)

    @property
    def reached(self) -> bool:
        """True if the cloud can be reached."""
        return self.managed and (Network not in self._robot or self._robot[Network].state.internet)

    async def leave(self) -> None:
        """Leave the cloud for good: no more maps and tasks from it."""
        if self._folder is not None:
            await self._robot[Settings].put(UNBOUND, True)

    def map(self) -> bytes | None:
        """Return the cloud's composite map for this robot; None without one, or out of reach."""
        return self._read("map.stcm", MAP_MAX) if self.reached else None

    def voices(self) -> list[VoicePackage]:
        """Return the cloud's voice packages. Raises InvalidGoal for a malformed file."""
        data = self._read("voice.json", VOICE_MAX)
        try:
            return decode_json(data, list[VoicePackage]) if data else []
        except msgspec.DecodeError as error:
            raise InvalidGoal(f"voice.json: {why_invalid(error, 'the list', wanted=list[VoicePackage])}") from None

    def start(self) -> None:
        """Start polling for tasks."""
        if self.managed and Delivery in self._robot:
            self._looking = asyncio.get_running_loop().create_task(self._look(), name=f"cloud of {self._robot.id}")

    def close(self) -> None:
        """Stop polling."""
        if self._looking is not None:
            self._looking.cancel()

    def _read(self, name: str, most: int) -> bytes | None:
        """Read a file of the folder; None if it is missing or too long."""
        assert self._folder is not None
        path = self._folder / name
        try:
            if path.stat().st_size > most:
                log.warning("%s is longer than %d bytes", path, most)
                return None
            return path.read_bytes()
        except OSError:
            return None

    async def _look(self) -> None:
        while self.managed:
            if self.reached:
                for path in self._tasks():
                    await self._take(path)
            await self._robot.clock.sleep(LOOK)

    def _tasks(self) -> list[Path]:
        assert self._folder is not None
        try:
            return sorted((self._folder / "tasks").glob("*.json"))[:TASKS_MAX]
        except OSError:
            return []

    async def _take(self, path: Path) -> None:
        """Queue a task and rename its file, so that the cloud sees the outcome."""
        try:
            data = self._read(f"tasks/{path.name}", TASK_MAX)
            request = request_of(decode_json(data or b"", CloudTask), path.stem)
            delivery = self._robot[Delivery]
            if request.number not in {order.number for order in delivery.orders}:  # accepted before a crash
                await delivery.accept(request)
            _mark(path)
        except (RobotError, msgspec.DecodeError) as error:
            why = why_invalid(error, wanted=CloudTask)
            log.warning("the cloud's task %s is refused: %s", path.name, why)
            _mark(path, refused=why)


def _mark(path: Path, refused: str = "") -> None:
    """Mark a task's outcome by its file's suffix."""
    try:
        if refused:
            path.with_suffix(".why").write_text(f"{refused}\n", encoding="utf-8")
        path.rename(path.with_suffix(".refused" if refused else ".taken"))
    except OSError:
        log.warning("%s cannot be renamed", path)


def request_of(task: CloudTask, name: str) -> OrderRequest:
    """Return the model's order; ``name`` stands in for a missing number. Raises InvalidGoal."""
    number = task.order_id or name[:64]
    if task.type == "INDUSTRY":
        if not task.task_targets:
            raise InvalidGoal("a round needs task_targets")
        *stops, target = [point.target_name for point in task.task_targets]
        return OrderRequest(
            OrderKind.ROUND,
            target,
            tuple(stops),
            waits=tuple(float(point.wait_time) for point in task.task_targets),
            tasks=tuple(point.action for point in task.task_targets),
            remote=True,
            number=number,
        )
    if task.location is None:
        raise InvalidGoal("a task needs a location")
    points = tuple(task.location.task_points)
    boxes = boxes_of(task.cargos or ())
    return OrderRequest(CLOUD_KINDS[task.type], task.location.poi_name, points, boxes, remote=True, number=number)
