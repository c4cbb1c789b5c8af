"""The nursery that all supervisors of a machine share: one is started, it serves all, and ends after the last."""

from __future__ import annotations

import fcntl
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest

from roboglot.hosting import installation
from roboglot.shards import node_client as module
from roboglot.shards.messages import MESSAGE_MAX, Birth, Born, Dead, Fork, Warm, encode, pair
from roboglot.shards.node_client import connect, last_words, socket_path

PATIENCE = 120.0  # s
CONNECTIONS = 8
# A nursery that has nothing to load, and whose shards send one packet and wait for the end of their link.
NURSERY = """
import os, socket, sys
from roboglot.shards import node_nursery as module

def run(folder, link):
    link.send(folder.encode())
    return len(link.recv(1))

module.IDLE = float(sys.argv[3])
{patch}
module.NodeNursery(socket.socket(fileno=int(sys.argv[1])), int(sys.argv[2]), run, 0.5).serve()
"""


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A private folder for sockets, with a short name."""
    with tempfile.TemporaryDirectory(dir="/tmp") as made:
        monkeypatch.setenv("XDG_RUNTIME_DIR", made)
        yield Path(made)


@contextmanager
def nursery(
    path: Path, *, owner: int = 0, idle: float = 3600.0, patch: str = ""
) -> Iterator[tuple[subprocess.Popen[bytes], socket.socket]]:
    """A nursery at ``path``, and a connection that waits before it starts."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(bytes(path))
        listening.listen()
        first = connected(path)
        given = (listening.fileno(), *filter(None, [owner]))
        code = [sys.executable, "-c", NURSERY.format(patch=patch), str(given[0]), str(owner), str(idle)]
        process = subprocess.Popen(code, pass_fds=given)
    with process, first:
        try:
            yield process, first
        finally:
            process.kill()


def connected(path: Path) -> socket.socket:
    control = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    control.settimeout(PATIENCE)
    control.connect(bytes(path))
    return control


def received(control: socket.socket) -> Birth:
    return msgspec.json.decode(control.recv(MESSAGE_MAX), type=Birth)


def forked(control: socket.socket, name: str) -> tuple[int, socket.socket]:
    """A shard's process and link."""
    ours, theirs = pair()
    ours.settimeout(PATIENCE)
    with theirs:
        socket.send_fds(control, [encode(Fork(1, name))], [theirs.fileno(), sys.stderr.fileno()])
    born = received(control)
    assert isinstance(born, Born)
    assert ours.recv(MESSAGE_MAX) == name.encode()
    return born.pid, ours


def test_nursery_ends_after_its_last_connection(folder: Path) -> None:
    with nursery(folder / "s", idle=0.001) as (process, first), connected(folder / "s") as last:
        hellos = [received(control) for control in (first, last)]
        assert all(isinstance(hello, Warm) and hello.seconds == 0.5 for hello in hellos)
        first.close()
        _, link = forked(last, "world")
        link.close()
        assert received(last) == Dead(1, 0)
        assert process.poll() is None
        last.close()
        assert process.wait(PATIENCE) == 0
        assert not (folder / "s").exists()


def test_nursery_ends_with_its_owner(folder: Path) -> None:
    theirs, ours = os.pipe()
    with nursery(folder / "s", owner=theirs) as (process, control):
        os.close(theirs)
        received(control)
        _, link = forked(control, "world")
        os.close(ours)
        link.close()
        assert received(control) == Dead(1, 0), "a connection is served to its end"
        control.close()
        assert process.wait(PATIENCE) == 0


def test_shards_end_with_their_connection_alone(folder: Path) -> None:
    with nursery(folder / "s") as (_, one), connected(folder / "s") as other:
        received(one), received(other)
        (_, lost), (_, kept) = forked(one, "lost"), forked(other, "kept")
        with lost, kept:
            one.shutdown(socket.SHUT_WR)
            assert one.recv(MESSAGE_MAX) == b"", "it hangs up"
            assert lost.recv(1) == b"", "after its shards"
            kept.send(b"x")
            assert received(other) == Dead(1, 1)


def test_another_user_is_not_served(folder: Path) -> None:
    with nursery(folder / "s", patch="module.user_of = lambda _: os.getuid() + 1") as (_, control):
        assert control.recv(MESSAGE_MAX) == b""


@pytest.fixture
def launches(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """Launches of nurseries, which do nothing but listen and hold their lock."""
    made: list[int] = []

    def launch(listening: int, log: int, _: str) -> None:
        made.extend((os.dup(listening), os.dup(log)))

    monkeypatch.setattr(module, "_launch", launch)
    yield made
    for descriptor in made:
        os.close(descriptor)


def hang_up(*nurseries: module.StartedNursery) -> None:
    for one in nurseries:
        one.control.close()
        assert one.process.wait() == 0


def test_many_who_begin_start_one_nursery(folder: Path, launches: list[int]) -> None:
    with ThreadPoolExecutor(CONNECTIONS) as threads:
        hang_up(*threads.map(connect, ["node"] * CONNECTIONS))
    assert len(launches) == 2, "its socket and its lock"
    hang_up(connect("another"))
    assert len(launches) == 4


def test_killed_ones_socket_is_replaced(folder: Path, launches: list[int]) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as killed:
        killed.bind(socket_path("node"))
    hang_up(connect("node"))
    assert len(launches) == 2


def test_deaf_nursery_is_an_error(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CONNECT_MAX", 0.0)
    with open(f"{socket_path('node')}.log", "w") as log:
        fcntl.flock(log, fcntl.LOCK_EX)
        with pytest.raises(OSError, match="neither answers nor ends"):
            connect("node")


def test_another_users_socket_is_not_used(
    folder: Path,
    launches: list[int],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "user_of", lambda _: os.getuid() + 1)
    with pytest.raises(PermissionError, match="another user's"):
        connect("node")


def test_open_folder_is_not_used(folder: Path) -> None:
    (folder / "roboglot").mkdir()
    (folder / "roboglot").chmod(0o755)  # readable by others, with any umask
    with pytest.raises(PermissionError, match="not a folder of our own"):
        connect("node")


def test_other_versions_and_nodes_have_other_nurseries(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ours = socket_path("node")
    monkeypatch.setenv("RAY_JOB_ID", "02")
    assert socket_path("node") == ours, "each of Ray's processes has another"
    assert socket_path("other") != ours
    with monkeypatch.context() as changed:
        changed.setenv("PGHOST", "db")
        assert socket_path("node") != ours
    with monkeypatch.context() as changed:
        changed.setattr(installation, "stamp", lambda: "newer")
        assert socket_path("node") != ours
    assert socket_path("node") == ours


def test_nursery_that_cannot_load_leaves_its_reason(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = folder / "python"
    program.write_text("#!/bin/sh\necho 'there is no room' >&2\nexit 3\n")
    program.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(program))
    with pytest.raises(OSError, match="the nursery ended with 3 at its start: there is no room"):
        connect("node")
    assert last_words("node") == "there is no room"


def test_supervisor_of_an_actor_loads_no_robots() -> None:
    """Its process should cost little more than Ray's own part of it."""
    code = (
        "import sys, roboglot.shards.actor, roboglot.shards.node_client, roboglot.shards.supervisor\n"
        "print(*{'numpy', 'numba', 'mujoco', 'grpc', 'uvloop', 'roboglot.runtime'} & {*sys.modules})"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"
