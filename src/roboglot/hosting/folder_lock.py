"""A folder for the exclusive use of one process."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path


class FolderInUse(RuntimeError):
    """Another process uses the folder."""


def lock_folder(folder: Path) -> int:
    """Create the folder and lock it for this process, until that ends. Raises FolderInUse, OSError."""
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            lock = os.open(folder / "lock", os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        except OSError as error:
            number = errno.ENOTDIR if isinstance(error, FileExistsError) else error.errno or 0
            raise OSError(number, f"{os.strerror(number)}; choose another folder with --data", str(folder)) from None
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            why = f"another roboglot uses {folder}; stop it, or choose another folder with --data"
            raise FolderInUse(why) from None
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(lock), os.stat(folder / "lock")):
                return lock
        os.close(lock)  # a fleet that did not start has deleted this file meanwhile


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Context in which the folder is locked for this process. Raises FolderInUse, OSError."""
    lock = lock_folder(folder)
    try:
        yield
    finally:
        os.close(lock)
