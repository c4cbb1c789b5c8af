"""Connects to the nursery of this machine, and starts it if there is none.

One serves all of a user's programs that give the same mark and have the same installation and environment.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

from roboglot.hosting import installation
from roboglot.shards.messages import MESSAGE_MAX
from roboglot.shards.nursery_client import StartedNursery
from roboglot.shards.warm_up import ENVIRONMENT

BACKLOG = 512  # connections that wait while the nursery loads
CONNECT_MAX = 10.0  # s for a nursery that ends to make room for another
AGAIN_SECONDS = 0.02
LOG_LINE_MAX = 1 << 12  # bytes
OF_A_WORKER = ("RAY_",)  # environment variables of which each process of Ray has others
PEER = struct.Struct("3i")  # pid, uid, gid


class Session:
    """The part of the nursery that serves one connection; it ends with that, after its shards.

    ``pid``: 0 until it has reported that it is ready.
    """

    def __init__(self, control: socket.socket) -> None:
        self.pid = 0
        self._control = control.dup()

    def poll(self) -> int | None:
        """Return 0: there is nothing to kill before it is ready; others may wait for the same nursery."""
        return 0

    def kill(self) -> None:
        """Kill it, and with it its shards."""
        if self.pid:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Hang up and wait until it has ended; return 0. Raises subprocess.TimeoutExpired."""
        deadline = None if timeout is None else time.monotonic() + timeout
        with contextlib.suppress(OSError):
            self._control.shutdown(socket.SHUT_WR)
        poll = select.poll()
        poll.register(self._control, select.POLLIN)
        while self.pid and self._control.fileno() >= 0:
            if not poll.poll(None if deadline is None else max(0.0, deadline - time.monotonic()) * 1e3):
                raise subprocess.TimeoutExpired("nursery", timeout or 0.0)
            with contextlib.suppress(BlockingIOError):
                if not _received(self._control):
                    break
        self._control.close()
        return 0


def _received(control: socket.socket) -> bytes:
    try:
        return control.recv(MESSAGE_MAX)
    except ConnectionResetError:
        return b""


def socket_path(mark: str) -> str:
    """Return the path of the nursery's socket, in a folder that only its owner can open. Raises OSError."""
    environment = [f"{key}={value}" for key, value in os.environ.items() if not key.startswith(OF_A_WORKER)]
    return installation.socket_path(os.environ, "nursery", mark, installation.stamp(), *sorted(environment))


def connect(mark: str) -> StartedNursery:
    """Return a connection to the nursery, which may still load. Raises OSError with a reason."""
    path, deadline = socket_path(mark), time.monotonic() + CONNECT_MAX
    while (control := _connected(path)) is None:
        if not _start(path):  # one is being started, or ends
            if time.monotonic() > deadline:
                raise OSError(f"the nursery at {path} neither answers nor ends")
            time.sleep(AGAIN_SECONDS)
    return StartedNursery(Session(control), control)


def last_words(mark: str) -> str:
    """Return the last line of the log of a nursery that has ended; empty if there is none."""
    with contextlib.suppress(OSError):
        return _last_line(_log(socket_path(mark)))
    return ""


def _last_line(path: str) -> str:
    lines = Path(path).read_bytes()[-LOG_LINE_MAX:].decode(errors="replace").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


def user_of(connection: socket.socket) -> int:
    """Return the user id of the process at the other end."""
    _, user, _ = PEER.unpack(connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, PEER.size))
    return int(user)


def _connected(path: str) -> socket.socket | None:
    """Return a connection; None if no process listens. Raises OSError."""
    control = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        control.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 2 * MESSAGE_MAX)
        control.connect(path)
        if user_of(control) != os.getuid():
            raise PermissionError(f"{path} is another user's")
    except (FileNotFoundError, ConnectionRefusedError):
        control.close()
        return None
    except BaseException:
        control.close()
        raise
    return control


def _log(path: str) -> str:
    return f"{path}.log"


def _start(path: str) -> bool:
    """Start a nursery that listens at ``path``; return False if there is one. Raises OSError.

    It holds a lock on its log as long as it runs.
    """
    log = os.open(_log(path), os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        try:
            fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not os.path.samestat(os.fstat(log), os.lstat(_log(path))):
                return False  # one that ended has removed it meanwhile
        except (BlockingIOError, FileNotFoundError):
            return False
        os.ftruncate(log, 0)
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)  # of a killed one: we have the lock
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
            os.fchmod(listening.fileno(), 0o600)
            listening.bind(path)
            listening.listen(BACKLOG)
            _launch(listening.fileno(), log, _log(path))
        return True
    finally:
        os.close(log)


def _launch(listening: int, log: int, path: str) -> None:
    """Start the nursery, which ends with our parent. Raises OSError."""
    owner = _parent()
    try:
        subprocess.run(
            [sys.executable, "-m", "roboglot.shards.node_nursery", str(listening), str(owner), path],
            pass_fds=[listening, log, *filter(None, [owner])],
            env=os.environ | ENVIRONMENT,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            cwd="/",
            start_new_session=True,
            check=True,
        )
    except subprocess.CalledProcessError as error:
        why = f": {words}" if (words := _last_line(path)) else ""
        raise OSError(f"the nursery ended with {error.returncode} at its start{why}") from None
    finally:
        if owner:
            os.close(owner)


def _parent() -> int:
    """Return a descriptor that can be read when our parent has ended; 0 if there is none to watch."""
    with contextlib.suppress(OSError, AttributeError):
        if (parent := os.getppid()) > 1:
            return os.pidfd_open(parent)
    return 0
