"""The nursery's handle when the nursery ends, when no other can be started at first, and while one loads."""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import cast

import pytest

from roboglot.shards import nursery_client as module
from roboglot.shards.messages import Warm, encode, pair
from roboglot.shards.nursery_client import NurseryClient, StartedNursery, launch


class FakeProcess:
    """A process that ends with 1, or only when it is killed."""

    def __init__(self, *, hangs: bool = False) -> None:
        self.pid, self.hangs = 1, hangs

    def wait(self, timeout: float | None = None) -> int:
        if self.hangs and timeout is not None:
            raise subprocess.TimeoutExpired("nursery", timeout)
        assert not self.hangs, "it would wait for ever"
        return 1

    def kill(self) -> None:
        self.hangs = False


class Starts:
    """Starts of nurseries, of which the second fails."""

    def __init__(self, *, hangs: bool) -> None:
        self.count, self.hangs = 0, hangs
        self.ends: list[socket.socket] = []

    def __call__(self) -> StartedNursery:
        self.count += 1
        if self.count == 2:
            raise OSError("no room for another process")
        ours, theirs = pair()
        self.ends.append(theirs)
        theirs.send(encode(Warm(0.1)))
        return StartedNursery(cast("subprocess.Popen[bytes]", FakeProcess(hangs=self.hangs)), ours)


@pytest.mark.parametrize("hangs", [False, True], ids=["ended", "hung"])
async def test_nursery_is_started_until_it_can(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hangs: bool) -> None:
    """Its shards count as dead at once, so that they start as soon as there is a nursery."""
    starts, dead = Starts(hangs=hangs), list[int]()
    monkeypatch.setattr(module, "launch", starts)
    monkeypatch.setattr(module, "AGAIN_SECONDS", 0.001)
    client = NurseryClient(lambda *_: None, lambda number, _: dead.append(number))
    client.open()
    await client.warm()
    with client.fork(3, tmp_path, sys.stderr.fileno()):
        starts.hangs = False
        starts.ends[0].close()
        async with asyncio.timeout(10.0):
            while len(starts.ends) < 2:  # noqa: ASYNC110 - there is no event of it
                await asyncio.sleep(0.0)
            await client.warm()
    assert (dead, starts.count) == ([3], 3)
    await client.close()
    starts.ends[1].close()


async def test_failed_fork_leaves_no_socket(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[socket.socket] = []

    def noted() -> tuple[socket.socket, socket.socket]:
        made.extend(pair())
        return made[0], made[1]

    client = NurseryClient(lambda *_: None, lambda *_: None)
    ours, theirs = pair()
    client._control = ours
    monkeypatch.setattr(module, "pair", noted)
    theirs.close()
    with ours, pytest.raises(OSError, match="Broken pipe"):
        client.fork(3, tmp_path, sys.stderr.fileno())
    assert [end.fileno() for end in made] == [-1, -1]


def test_ctrl_c_does_not_reach_a_loading_nursery() -> None:
    """Python would print where it was while it starts."""
    nursery = launch()
    try:
        assert os.getpgid(nursery.process.pid) == nursery.process.pid
    finally:
        nursery.abandon()


@pytest.fixture
def loading() -> Iterator[subprocess.Popen[bytes]]:
    """A nursery that loads for ever, by a process of its own."""
    work = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'print(1, flush=True); input()'])"
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", work], stdin=pipe, stdout=pipe, process_group=0) as process:
        yield process
        process.kill()


async def test_closing_does_not_wait_for_loading(
    loading: subprocess.Popen[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may compile kernels for a minute."""
    ours, theirs = pair()
    monkeypatch.setattr(module, "launch", lambda: StartedNursery(loading, ours))
    client = NurseryClient(lambda *_: None, lambda *_: None)
    client.open()
    assert loading.stdout is not None
    assert loading.stdout.readline() == b"1\n"
    with theirs:
        async with asyncio.timeout(20.0):
            await client.close()
    assert loading.stdout.read() == b"", "read to its end: no process has it open for writing"
