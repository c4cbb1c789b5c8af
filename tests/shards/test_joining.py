"""Joining Ray: what is missing is named at once, and a start that Ray gave up is repeated."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("ray", reason="Ray, which roboglot's extra `fleet` brings, is not installed")

os.environ["RAY_AUTH_MODE"] = "disabled"  # no token in the home folder
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

import ray

from roboglot.shards import ray_processes
from roboglot.shards.joining import join, own_token
from roboglot.shards.ray_processes import NICENESS
from roboglot.testing.addresses import free_addresses

# Ray's own threads leave sockets and files to the collector.
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture
def head() -> Iterator[str]:
    """URL at which something listens."""
    with socket.create_server((free_addresses(1), 0)) as listening:
        yield "ray://{}:{}".format(*listening.getsockname())


@pytest.mark.parametrize("where", ["ray://{}", "ray://{}:1", "{}:1"])
def test_missing_head_is_named_at_once(where: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray itself would try again for minutes."""
    monkeypatch.setattr(ray, "init", lambda **_: pytest.fail("Ray was asked"))
    where = where.format(free_addresses(1))
    with pytest.raises(OSError, match=f"^--on {where}: no Ray head answers there: Connection refused$"):
        join(where)


def test_failed_client_server_is_named_by_its_reason(monkeypatch: pytest.MonkeyPatch, head: str) -> None:
    reason = "RuntimeError: Starting Ray client server failed."

    def refuse(**_: object) -> None:
        raise ConnectionAbortedError(f"Initialization failure from server:\nTraceback:\n{reason}")

    monkeypatch.setattr(ray, "init", refuse)
    with pytest.raises(OSError, match=f"^--on {head}: Initialization failure from server: {reason}$"):
        join(head)


@pytest.mark.parametrize("failures", [1, 3])
def test_ray_that_gave_itself_up_is_started_again(failures: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine its agents take more than the 15 s that it allows; the third time, the reason is named."""
    left: list[subprocess.Popen[bytes]] = []

    def init(**_: object) -> None:
        if len(left) < failures:
            left.append(subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE))
            raise Exception("The current node timed out during startup. This could happen because some")

    monkeypatch.setattr(ray, "init", init)
    if failures == 1:
        join("local")
    else:
        with pytest.raises(OSError, match=r"^--on local: this machine is too busy: Ray gave itself up 3 times because"):
            join("local")
    assert [process.wait(60) for process in left] == [-signal.SIGKILL] * failures


def test_shards_have_the_priority_of_their_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """With Ray's own they stood still beside busy processes."""
    found: list[str | None] = []
    monkeypatch.setattr(ray, "init", lambda **_: found.append(os.environ.get(NICENESS)))
    monkeypatch.setitem(os.environ, NICENESS, "")  # restored afterwards
    del os.environ[NICENESS]
    join("local")
    os.environ[NICENESS] = "3"  # the user's own
    join("local")
    assert found == ["0", "3"], "what Ray adds to the priority of its own processes, which is the command's"


@pytest.mark.parametrize(("parent", "setting", "wanted"), [("raylet", None, 3), ("raylet", "15", 0), ("bash", None, 0)])
def test_actor_keeps_the_priority_of_rays_node(
    parent: str, setting: str | None, wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ray lowers it while others keep the processor busy, and the nursery inherits it."""
    found = dict[int, int]()
    monkeypatch.setitem(os.environ, NICENESS, setting or "")  # restored afterwards
    if setting is None:
        del os.environ[NICENESS]
    monkeypatch.setattr(ray_processes, "Path", lambda _: SimpleNamespace(read_text=lambda: f"{parent}\n"))
    monkeypatch.setattr(os, "getpriority", lambda *_: 3)
    monkeypatch.setattr(os, "setpriority", lambda _, thread, niceness: found.update({thread: niceness}))
    ray_processes.keep_priority()
    assert set(found.values()) == ({wanted} if wanted else set())
    assert not found or os.getpid() in found, "of each thread, the first one's too"

    def refuse(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "setpriority", refuse)
    ray_processes.keep_priority()


def test_silent_head_is_named_with_both_reasons(monkeypatch: pytest.MonkeyPatch, head: str) -> None:
    def time_out(**_: object) -> None:
        warnings.warn("Ray Client connection timed out.", stacklevel=1)
        raise ConnectionError("ray client connection timeout")

    monkeypatch.setattr(ray, "init", time_out)
    with (
        warnings.catch_warnings(action="error"),
        pytest.raises(OSError, match=rf"^--on {head}: no Ray head answers there, or it requires a token"),
    ):
        join(head)


def test_token_is_found_where_ray_keeps_it(tmp_path: Path) -> None:
    assert not own_token({}, tmp_path)
    assert own_token({"RAY_AUTH_TOKEN": "x"}, tmp_path)
    (tmp_path / ".ray").mkdir()
    (tmp_path / ".ray/auth_token").write_text("x")
    assert own_token({}, tmp_path)
