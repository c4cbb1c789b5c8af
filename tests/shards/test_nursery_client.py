"""The nursery's handle when the nursery ends, and when no other can be started at first; without processes."""

from __future__ import annotations

import asyncio
import socket
import subprocess
import sys
from pathlib import Path
from typing import cast

import pytest

from roboglot.shards import nursery_client as module
from roboglot.shards.messages import Warm, encode, pair
from roboglot.shards.nursery_client import NurseryClient, StartedNursery


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
