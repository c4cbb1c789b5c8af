"""File transfers to the app: sent in chunks, offered again when the app is back (pushes 4003 and 4005)."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import AsyncGenerator, Awaitable, Callable
from pathlib import Path

from roboglot.media.video import beside
from roboglot.model.components.system.disk import LOW, Disk
from roboglot.model.errors import Busy, NotFound, Refused, RobotError
from roboglot.model.events import DiskLow
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from roboglot.protocols.cyberdog.table import push
from roboglot.wire.cyberdog.codes import Code, FileError
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

log = logging.getLogger(__name__)
LEFT_FILES = push(Code.LEFT_FILES)
DISK_LOW = push(Code.DISK_LOW)
CHUNK = 4_000_000  # bytes: with the other fields still a message that every client accepts
HOST_TRANSFERS_MAX = 6
TRANSFERS_MAX = 12  # of all hosts, so that one leaves some to others
OFFER_AFTER = 2.75  # s of uninterrupted heartbeats before unfetched files are offered: the sixth
ERRORS: tuple[tuple[type[RobotError], FileError], ...] = (
    (Busy, FileError.BUSY),
    (Refused, FileError.STATE),
    (NotFound, FileError.NOT_THERE),
    (RobotError, FileError.INNER),
)


class Transfers:
    """Sends files in chunks; removes those delivered, and offers the rest when the app is back.

    Written bytes may still be lost on the network, so a heartbeat to the app must get through afterwards. For clients
    without heartbeats, an uncancelled call has to suffice.
    """

    def __init__(self, robot: Robot, files: CameraFiles, app: AppLink) -> None:
        self._robot, self._files, self._app = robot, files, app
        self._under_way = Counter[str]()  # by host
        self._offering: asyncio.Task[None] | None = None
        self._keeping: asyncio.Task[None] | None = None
        self._proving: set[asyncio.Task[None]] = set()
        self._leave = robot.events.listen(DiskLow, lambda event: app.push(DISK_LOW, {"remain_size": event.free}))
        app.on_found.append(self._found)
        app.on_lost.append(self._lost)

    async def send(self, host: str, command: Callable[[], Awaitable[Path]]) -> AsyncGenerator[pb.FileChunk, None]:
        """Yield to ``host`` the chunks of the file of ``command``, or one chunk with the error."""
        if self._under_way[host] >= HOST_TRANSFERS_MAX or self._under_way.total() >= TRANSFERS_MAX:
            yield pb.FileChunk(error_code=FileError.TOO_MANY)
            return
        self._under_way[host] += 1
        try:
            path = await command()
            size = path.stat().st_size
            for start in range(0, max(1, size), CHUNK):
                part = await beside(self._robot.clock, _reading(path, start))
                yield pb.FileChunk(error_code=FileError.NONE, file_name=path.name, file_size=size, buffer=part)
            if self._app.connected:
                task = asyncio.get_running_loop().create_task(self._remove_if_there(path), name=f"sent {path.name}")
                self._proving.add(task)
                task.add_done_callback(self._proving.discard)
            else:
                self._files.remove(path)
        except (RobotError, OSError) as error:
            log.info("cannot send a file: %s", error)
            yield pb.FileChunk(error_code=error_of(error))
        finally:
            self._under_way[host] -= 1
            self._under_way += Counter()  # without hosts that have none

    async def _remove_if_there(self, path: Path) -> None:
        if await self._app.alive():
            self._files.remove(path)

    async def close(self) -> None:
        """Keep the current recording and files whose delivery is uncertain."""
        self._leave()
        for task in self._proving:
            task.cancel()
        for waiting in (self._offering, self._keeping):
            if waiting:
                waiting.cancel()
        await self._keep(at_once=True)

    def _found(self) -> None:
        self._offering = asyncio.get_running_loop().create_task(self._offer(), name="offer files")
        if Disk in self._robot and (free := self._robot[Disk].free) < LOW:  # no app was notified
            self._app.push(DISK_LOW, {"remain_size": free})

    async def _offer(self) -> None:
        await self._robot.clock.sleep(OFFER_AFTER)
        if self._keeping:  # an app may return before its film is written
            await asyncio.wait([self._keeping])
        if names := self._files.names():
            self._app.push(LEFT_FILES, {"file_name": names})

    def _lost(self) -> None:
        """End the recording, which waits for the app."""
        if self._offering:
            self._offering.cancel()
        self._keeping = asyncio.get_running_loop().create_task(self._keep(), name="keep the recording")

    async def _keep(self, *, at_once: bool = False) -> None:
        if not self._files.recording:
            return
        try:
            await self._files.stop(at_once=at_once)
        except (RobotError, OSError) as error:
            log.warning("the recording was lost: %s", error)


def error_of(error: Exception) -> FileError:
    return next((code for kind, code in ERRORS if isinstance(error, kind)), FileError.NOT_THERE)


def _reading(path: Path, start: int) -> Callable[[], bytes]:
    def read() -> bytes:
        with path.open("rb") as file:
            file.seek(start)
            return file.read(CHUNK)

    return read
