"""A folder is one program's, also while its lock is deleted."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

from roboglot.hosting import folder_lock


def test_lock_on_a_deleted_file_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flock, deleted = fcntl.flock, list[int]()

    def delete_first(file: int, operation: int) -> None:
        if not deleted:
            (tmp_path / "lock").unlink()  # by a fleet that did not start, after we have opened it
            deleted.append(file)
        flock(file, operation)

    monkeypatch.setattr(fcntl, "flock", delete_first)
    held = folder_lock.lock_folder(tmp_path)
    with pytest.raises(folder_lock.FolderInUse):
        folder_lock.lock_folder(tmp_path)
    os.close(held)
