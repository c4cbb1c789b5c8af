"""Photos and recordings on the robot, kept until an app has fetched them. Knows no message.

Files are named by robot time, as on cameras; each robot has a separate folder.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path

from roboglot.media.recorder import Recorder
from roboglot.media.stills import jpeg
from roboglot.media.video import beside
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.system.disk import LOW, Disk
from roboglot.model.errors import NotFound, Refused
from roboglot.model.robot import Robot

FILES_MAX = 500


class CameraFiles:
    """Stores pictures in ``folder``; files found there after a restart are still to be fetched."""

    def __init__(self, robot: Robot, folder: Path) -> None:
        self._robot, self._folder = robot, folder
        self._recording = ""  # name of the file being written
        self._second, self._given = "", set[str]()  # names given in the newest second
        for name in self.names():
            self._take(name)

    def names(self) -> list[str]:
        """Return the files to fetch, oldest first, without the current recording."""
        if not self._folder.is_dir():
            return []
        return sorted(path.name for path in self._folder.iterdir() if path.suffix in (".jpg", ".mp4"))

    def path(self, name: str) -> Path:
        """Return the path of a file to be fetched; raises NotFound for any other name."""
        if name not in self.names():
            raise NotFound(f"there is no file {name!r}")
        return self._folder / name

    async def photograph(self) -> Path:
        """Take a photo. Raises Refused without disk space."""
        frame = await self._robot[Camera].capture()
        picture = await beside(self._robot.clock, lambda: jpeg(frame))
        path = self._new(".jpg")
        await beside(self._robot.clock, _writing(path, picture))
        self._take(path.name)
        return path

    def record(self) -> None:
        """Start recording. Raises Busy while recording, Refused without disk space."""
        path = self._new(".mp4")
        self._robot[Recorder].start(path)
        self._recording = path.name

    async def stop(self, *, at_once: bool = False) -> Path:
        """End the recording, ``at_once`` without waiting for a picture. Raises Refused unless this door records."""
        if not self._recording:
            raise Refused("nothing is being recorded")
        self._recording = ""
        path = (await self._robot[Recorder].stop(at_once=at_once)).path
        self._take(path.name)
        return path

    @property
    def recording(self) -> bool:
        """True while this door records."""
        return bool(self._recording)

    def remove(self, path: Path) -> None:
        """Remove a file that was fetched completely."""
        path.unlink(missing_ok=True)
        if Disk in self._robot:
            self._robot[Disk].release(_use(path.name))

    def _new(self, suffix: str) -> Path:
        """Return a name, numbered within the same second: never that of a file that was just fetched."""
        if len(self.names()) >= FILES_MAX or self._free() <= 0:
            raise Refused("the disk is full")
        self._folder.mkdir(parents=True, exist_ok=True)
        stem = time.strftime("%Y%m%d_%H%M%S", time.gmtime(self._robot.clock.epoch()))
        if stem != self._second:
            self._second, self._given = stem, set()
        path, number = self._folder / f"{stem}{suffix}", 0
        while path.name in self._given or path.exists():
            number += 1
            path = self._folder / f"{stem}_{number}{suffix}"
        self._given.add(path.name)
        return path

    def _free(self) -> int:
        """Return the free space, bytes."""
        if Disk in self._robot:
            return self._robot[Disk].free
        ours = next(folder for folder in (self._folder, *self._folder.parents) if folder.is_dir())
        return shutil.disk_usage(ours).free - LOW

    def _take(self, name: str) -> None:
        """Reserve space on the simulated disk; without space, delete the file and raise Refused.

        Pictures of a real robot are on this machine's disk, which keeps its own account.
        """
        if Disk not in self._robot:
            return
        path = self._folder / name
        try:
            self._robot[Disk].take(_use(name), path.stat().st_size)
        except Refused:
            path.unlink(missing_ok=True)
            raise


def _use(name: str) -> str:
    return f"camera {name}"


def _writing(path: Path, data: bytes) -> Callable[[], object]:
    def write() -> None:
        part = path.with_name(f"{path.name}.part")
        part.write_bytes(data)
        part.replace(path)

    return write
