"""Files of classes: a folder for each, with its name and the pupils' hand-ins. Its functions block."""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
from pathlib import Path
from typing import TypeVar

import msgspec

T = TypeVar("T")
log = logging.getLogger(__name__)
CLASS, OPEN_CLASS = "class.json", "open_class.json"
CLASSES_MAX, WORKS_MAX, FILE_MAX = 20, 60, 4_000_000  # folders; files in each; bytes read of a file


class PupilWork(msgspec.Struct):
    """Stored work of a pupil: the program as last seen and as handed in, and its world."""

    name: str = ""
    world: str = "-"
    program: str = ""
    style: str = ""
    handed: str = ""
    stars: int = 0  # of the handed-in program
    all_stars: int = 0


class ClassRecord(msgspec.Struct):
    """A class. ``until``: Unix time (s) at which its code admits no more pupils."""

    code: str
    name: str
    only: str = ""
    until: float = 0.0
    works: list[PupilWork] = []


class KeptClass(msgspec.Struct):
    """The class of a console's own page. ``until``: Unix time (s); ``seats``: robots by the pupils' identities."""

    code: str
    name: str
    until: float
    seats: dict[str, str] = {}


class OpenClassFile:
    """File of the class that is open on a console's own page, in the folder of the classes."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / OPEN_CLASS

    def load(self) -> KeptClass | None:
        """Return the class; None if none is open. An unreadable one is skipped with a warning."""
        try:
            return _read(self._file, KeptClass)
        except FileNotFoundError:
            return None
        except (OSError, ValueError, msgspec.MsgspecError) as error:
            log.warning("left out the class in %s: %s", self._file, error)
            return None

    def keep(self, kept: KeptClass | None) -> None:
        """Write the class, or delete it. After a failure it lasts only until the program ends."""
        try:
            if kept is None:
                self._file.unlink(missing_ok=True)
                return
            self._file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            _write(self._file, msgspec.json.encode(kept))
        except OSError as error:
            log.error("cannot keep the class over a restart: %s: %s", self._file, error)


class ClassFiles:
    """Files of classes in one folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def load(self) -> list[ClassRecord]:
        """Return all classes, the oldest first; unreadable ones are skipped with a warning."""
        try:
            folders = sorted((f for f in self._folder.iterdir() if f.is_dir()), key=lambda f: f.stat().st_mtime)
        except FileNotFoundError:
            return []
        return [record for folder in folders[-CLASSES_MAX:] if (record := _read_class(folder)) is not None]

    def begin(self, code: str, name: str, only: str, until: float) -> None:
        """Write a class, replacing its former data. Raises OSError."""
        folder = self._folder / code
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        _write(folder / CLASS, msgspec.json.encode(ClassRecord(code, name, only, until)))

    def keep(self, code: str, work: PupilWork) -> None:
        """Write a pupil's work, replacing the former. Raises OSError."""
        name = hashlib.sha256(work.name.encode("utf-8", "surrogatepass")).hexdigest()[:24]
        _write(self._folder / code / f"{name}.json", msgspec.json.encode(work))

    def end(self, code: str) -> None:
        """Delete a class."""
        shutil.rmtree(self._folder / code, ignore_errors=True)


def _read_class(folder: Path) -> ClassRecord | None:
    try:
        record = _read(folder / CLASS, ClassRecord)
        if record.code != folder.name:
            raise ValueError(f"it belongs to class {record.code!r}")
        files = sorted(file for file in folder.glob("*.json") if file.name != CLASS)
        record.works = [_read(file, PupilWork) for file in files[:WORKS_MAX]]
    except (OSError, ValueError, msgspec.MsgspecError) as error:
        log.warning("left out the class in %s: %s", folder, error)
        return None
    return record


def _read(file: Path, kind: type[T]) -> T:
    if file.stat().st_size > FILE_MAX:
        raise ValueError(f"{file.name} is longer than {FILE_MAX} bytes")
    return msgspec.json.decode(file.read_bytes(), type=kind)


def _write(file: Path, data: bytes) -> None:
    """Write a file; a crash leaves the old or the new one."""
    fresh = file.with_suffix(".new")
    with fresh.open("wb") as opened:
        os.fchmod(opened.fileno(), 0o600)
        opened.write(data)
        opened.flush()
        os.fsync(opened.fileno())
    fresh.replace(file)
