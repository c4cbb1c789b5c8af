"""Content of a fleet's folder before a start, which a start that is refused brings back."""

from __future__ import annotations

import contextlib
import logging
import shutil
from collections.abc import Iterator
from pathlib import Path

from roboglot.hosting.error_text import in_words
from roboglot.shards.plan import EarlierPlan

log = logging.getLogger(__name__)
MADE = ("lock", "holder", "detached", "classes", "shards/*", "shards", "nodes/*/shards/*", "nodes/*", "nodes")


class FolderBefore:
    """Earlier plan and files of the folder of a fleet. Call ``look`` as soon as the folder is locked."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.is_kept = False  # set once a world is up, or may be: its robots store data
        self._is_new = not folder.exists()
        self._new_parents = [parent for parent in folder.parents if not parent.exists()]
        self._has_lock = (folder / "lock").exists()
        self._plan: EarlierPlan | None = None
        self._files: set[Path] = set()

    def look(self) -> None:
        """Note the plan and the files. Raises OSError."""
        self._plan, self._files = EarlierPlan(self.folder), set(self._made())
        if not self._has_lock:
            self._files.discard(self.folder / "lock")

    def restore_plan(self) -> None:
        """Go back to the earlier plan, or none; on a full disk, the new one stays."""
        try:
            if self._plan is not None and self._plan.restore():
                log.warning("the new plan is not kept")
        except OSError as error:
            log.warning("the new plan stays: %s", in_words(error))

    def clear(self) -> None:
        """Delete what the start has added, unless it is to be kept. The folder must still be locked."""
        if self.is_kept or self._plan is None:
            return
        if self._is_new:
            shutil.rmtree(self.folder, ignore_errors=True)
            with contextlib.suppress(OSError):
                for parent in self._new_parents:
                    parent.rmdir()
            return
        for path in self._made():
            if path not in self._files:
                _delete(path)

    def _made(self) -> Iterator[Path]:
        return (path for pattern in MADE for path in self.folder.glob(pattern))


def _delete(path: Path) -> None:
    """Delete a file or a folder with its content, as far as that is possible."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
        return
    with contextlib.suppress(OSError):
        path.unlink()
