"""Starts a command in the warm parent of this installation, forwards signals to it, and ends with its status.

Without a parent the command starts cold, and a parent is started for the next one. ``python -m
roboglot.cli.warm.command -c CODE`` is ``python -c CODE`` of a warm interpreter, for workers of pytest-xdist.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import resource
import signal
import socket
import sys

from roboglot.hosting import installation

COMMAND, CODE = "command", "code"
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2)
LIMITS = (resource.RLIMIT_NOFILE, resource.RLIMIT_CPU, resource.RLIMIT_AS, resource.RLIMIT_FSIZE, resource.RLIMIT_CORE)
LENGTH = 8  # bytes before a message, its length
MESSAGE_MAX = 4 << 20
DESCRIPTORS_MAX, HIGHEST = 64, 255  # of the files that a command inherits; with others it starts cold
BROKEN = 70  # exit status if the parent was killed


def run(kind: str, words: list[str]) -> int | None:
    """Run a command in the parent; return its exit status, negative for a signal. None: there is no parent."""
    if not installation.is_wanted(os.environ):
        return None
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # signals from now on are for the command
    try:
        path = installation.socket_path(os.environ)
        parent = _connected(path, kind, words)
        if parent is not None:
            with parent:
                return _stand_for_it(parent, before)
    except OSError:
        return None  # commands start cold where there is no place for a socket
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    launch(path)
    return None


def end_like(status: int) -> None:
    """End this process with the status of the command."""
    if status < 0:
        with contextlib.suppress(OSError, ValueError):  # some signals have no default action that ends
            signal.signal(-status, signal.SIG_DFL)
            os.kill(os.getpid(), -status)
        status = 128 - status
    os._exit(status)


def launch(path: str) -> None:
    """Start a parent for the next command, unless one is starting. It ends by itself."""
    import subprocess

    with contextlib.suppress(OSError), open(f"{path}.log", "wb") as log:
        if _is_locked(f"{path}.lock"):
            return
        subprocess.Popen(
            [sys.executable, "-m", "roboglot.cli.warm.parent", path],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            cwd="/",
            start_new_session=True,
        ).returncode = 0  # it outlives us


def _is_locked(path: str) -> bool:
    with open(path, "a", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def _connected(path: str, kind: str, words: list[str]) -> socket.socket | None:
    """Start the command and return its connection; None without a parent of these sources. Raises OSError."""
    descriptors = _inherited()  # first: a socket would get the number of one that is closed
    request = ascii(_request(kind, words, descriptors)).encode()  # a parent that is connected waits for it
    parent = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        parent.connect(path)
        socket.send_fds(parent, [len(request).to_bytes(LENGTH)], descriptors)
        parent.sendall(request)
        if parent.recv(1) == b"+":
            return parent
    except OSError:  # none listens, or it ends just now
        pass
    parent.close()
    return None


def _inherited() -> list[int]:
    """Return the descriptors that a program inherits: a shell gives more than three for ``<(…)``. Raises OSError."""
    found = [0, 1, 2]
    for number in found:
        os.fstat(number)
    for number in sorted(int(name) for name in os.listdir("/proc/self/fd")):
        with contextlib.suppress(OSError):  # that of the listing itself
            if number > 2 and os.get_inheritable(number):
                found.append(number)
    if len(found) > DESCRIPTORS_MAX or found[-1] > HIGHEST:
        raise OSError("too many open files to send")
    return found


def _request(kind: str, words: list[str], descriptors: list[int]) -> dict[str, object]:
    """Return all that the command would have inherited from this process. Raises OSError."""
    what = {"stamp": installation.stamp(), "kind": kind, "words": words, "descriptors": descriptors}
    return what | surroundings()


def surroundings() -> dict[str, object]:
    """Return what a program started by this process inherits, but its files."""
    os.umask(umask := os.umask(0o077))
    return {
        "folder": os.getcwd(),
        "environment": dict(os.environ),
        "path": sys.path,
        "umask": umask,
        "ignored": [int(number) for number in SIGNALS if signal.getsignal(number) == signal.SIG_IGN],
        "limits": [(kind, *resource.getrlimit(kind)) for kind in LIMITS],
        "processors": sorted(os.sched_getaffinity(0)),
    }


def _stand_for_it(parent: socket.socket, mask: set[int | signal.Signals]) -> int:
    """Forward signals, except those of ``mask``, until the command has ended; return its status."""

    def pass_on(number: int, _: object) -> None:
        with contextlib.suppress(OSError):
            parent.send(bytes([number]))

    def pause(_: int, frame: object) -> None:
        pass_on(signal.SIGSTOP, frame)
        os.kill(os.getpid(), signal.SIGSTOP)
        pass_on(signal.SIGCONT, frame)

    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, pass_on)
    signal.signal(signal.SIGTSTP, pause)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    try:
        answer = parent.recv(LENGTH)
    except OSError:
        answer = b""
    if not answer:
        sys.stderr.write("roboglot: the process from which this one was forked has ended\n")
        return BROKEN
    return int.from_bytes(answer, signed=True)


def main(words: list[str]) -> None:
    """Act as ``python`` with these arguments: ``-u`` has no effect, ``-c CODE`` is followed by its own arguments."""
    code = words[words.index("-c") + 1 :]
    status = run(CODE, code)
    if status is None:
        os.execv(sys.executable, [sys.executable, *words])
    end_like(status)


if __name__ == "__main__":
    main(sys.argv[1:])
