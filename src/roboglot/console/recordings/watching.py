"""Recordings watched on a page: outline, excerpts and pictures of one robot, read in a thread, one at a time."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from roboglot.console.recordings.kept import RecordingFolder
from roboglot.extras import explaining
from roboglot.model.errors import InvalidGoal, NotFound, Refused

if TYPE_CHECKING:
    from roboglot.console.recordings.excerpts import Excerpts

OPEN_MAX = 2  # recordings whose index is kept
SECONDS_MAX = 120.0  # of one excerpt


class Watching:
    """Reads the recordings of a folder for pages that watch them; not one that is being written."""

    def __init__(self, folder: RecordingFolder, running: Callable[[], Path | None]) -> None:
        """``running``: returns the file that is being written, if any."""
        self._folder, self._running = folder, running
        self._turn = asyncio.Lock()
        self._open: OrderedDict[tuple[str, int, int], Excerpts] = OrderedDict()

    async def outline(self, file: str) -> dict[str, object]:
        """Return length (s), robots and marks of a recording. Raises NotFound, Refused, BadRecording, OSError."""
        async with self._turn:
            return await asyncio.to_thread(self._outline, self._folder.path(file))

    async def excerpt(self, file: str, robot: str, since: float, seconds: float) -> bytes:
        """Return a robot's frames from ``since`` on (s since the beginning); see ``Excerpts.read``.

        Raises NotFound, Refused, InvalidGoal, BadRecording, OSError.
        """
        if not 0.0 < seconds <= SECONDS_MAX:
            raise InvalidGoal(f"an excerpt has at most {SECONDS_MAX:g} s")
        async with self._turn:
            return await asyncio.to_thread(self._excerpt, self._folder.path(file), robot, since, seconds)

    async def picture(self, file: str, robot: str, at: float) -> bytes:
        """Return what a robot's camera saw at a moment (s since the beginning), as a JPEG.

        Raises NotFound, Refused, BadRecording, OSError.
        """
        async with self._turn:
            return await asyncio.to_thread(self._picture, self._folder.path(file), robot, at)

    def _outline(self, path: Path) -> dict[str, object]:
        excerpts = self._excerpts(path)
        return {
            "seconds": excerpts.seconds,
            "robots": excerpts.robots,
            "filmed": excerpts.filmed,
            "marks": excerpts.marks(),
        }

    def _excerpt(self, path: Path, robot: str, since: float, seconds: float) -> bytes:
        excerpts = self._excerpts(path)
        if robot not in excerpts.robots:
            raise NotFound(f"there is no robot {robot!r} in {path.name}")
        return excerpts.read(robot, since, seconds)

    def _picture(self, path: Path, robot: str, at: float) -> bytes:
        from roboglot.console.recordings.pictures import last_picture

        return last_picture(self._excerpts(path).film(robot, at))

    def _excerpts(self, path: Path) -> Excerpts:
        with explaining("watching recordings", "recording"):
            from roboglot.console.recordings.excerpts import Excerpts
        if (running := self._running()) is not None:  # it changes, and would be read anew each time
            for one in self._folder.look(running):
                if one.running and path.name in {part.file for part in one.parts}:
                    raise Refused(f"{path.name} is being written: end the recording first")
        state = path.stat()
        key = path.name, state.st_size, state.st_mtime_ns
        found = self._open.pop(key, None) or Excerpts(path)
        self._open[key] = found
        while len(self._open) > OPEN_MAX:
            self._open.popitem(last=False)
        return found
