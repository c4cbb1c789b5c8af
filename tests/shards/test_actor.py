"""The actor of a shard without Ray: its supervisor, its nursery, and what the fleet hears of them."""

from __future__ import annotations

import logging
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest

from roboglot.hosting import logs
from roboglot.hosting.process import has_ended, running
from roboglot.shards import actor as module
from roboglot.shards import node_client, nursery_client
from roboglot.shards.actor import Condition, LogTail, ShardActor
from roboglot.shards.nursery_client import NotWarm
from roboglot.shards.plan import plan_fleet
from roboglot.shards.states import LOG_FILE, State, rotate
from roboglot.testing.addresses import free_addresses

PATIENCE = 120.0  # s
NODE = "0123456789abcdef"


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A node of Ray, with a private folder for its nursery's socket."""
    context = SimpleNamespace(get_node_id=lambda: NODE)
    monkeypatch.setitem(sys.modules, "ray", SimpleNamespace(get_runtime_context=lambda: context))
    monkeypatch.setattr(logs, "set_up_logging", lambda **_: None)
    monkeypatch.setattr(node_client, "OF_A_WORKER", ("RAY_", "PYTEST_"))  # pytest notes the test's phase in one
    own = logging.getLogger("roboglot")
    before, level = own.handlers[:], own.level
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        yield
    own.handlers[:] = before
    own.setLevel(level)


@pytest.fixture
def actors(node: None, tmp_path: Path) -> Iterator[list[ShardActor]]:
    """Two actors of one node."""
    plan = plan_fleet(2, 1, {"console": {"enabled": False}}, tmp_path, first=free_addresses(2))
    made = [ShardActor(one.name, one.settings, str(tmp_path), of_node=one.name == "w2") for one in plan.shards]
    yield made
    for actor in made:
        actor.stop()


def seen(actor: ShardActor, condition: Callable[[Condition], bool], known: int = 0) -> Condition:
    """The first state for which a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition(state := msgspec.json.decode(actor.look(known), type=Condition)):
        assert time.monotonic() < end, state
        time.sleep(0.01)
    return state


def is_ready(state: Condition) -> bool:
    return state.state is State.READY


def nursery_of(shard: int) -> int:
    """The nursery from which a shard was forked, by a process that serves its supervisor."""
    parents = {one.pid: one.parent for one in running()}
    return parents[parents[shard]]


def test_killed_shard_returns_from_its_nodes_nursery(actors: list[ShardActor], tmp_path: Path) -> None:
    first, second = (seen(actor, is_ready) for actor in actors)
    assert {nursery_of(first.pid), nursery_of(second.pid)} == {nursery := nursery_of(first.pid)}, "one for both"
    assert first.ready is not None
    assert [*first.ready.endpoints] == ["a1"]
    assert seen(actors[0], is_ready, known=first.birth).ready is None, "it is there already"
    os.kill(first.pid, signal.SIGKILL)
    again = seen(actors[0], lambda state: is_ready(state) and state.restarts >= 1, known=first.birth)
    assert (again.run, again.hopeless, nursery_of(again.pid)) == (first.run, False, nursery)
    assert again.ready is not None, "of the new process"
    assert seen(actors[1], is_ready).pid == second.pid
    seen(actors[0], lambda _: "can map and navigate" in (tmp_path / "shards/w1" / LOG_FILE).read_text())
    for actor in actors:
        actor.stop()
    assert has_ended(again.pid)
    assert has_ended(second.pid)


def test_shards_lines_reach_the_fleet_of_a_cluster(actors: list[ShardActor]) -> None:
    lines: list[str] = []

    def has_said(state: Condition) -> bool:
        lines.extend(state.lines)
        return any("can map and navigate" in line for line in lines)

    seen(actors[1], has_said)


def test_wrong_settings_are_not_tried_again(node: None, tmp_path: Path) -> None:
    actor = ShardActor("w1", {"data": str(tmp_path / "data"), "wrld": "moon"}, str(tmp_path), of_node=False)
    state = seen(actor, lambda state: state.hopeless)
    assert (state.state, state.restarts, state.ready) == (State.FAILED, 0, None)
    assert "wrld" in state.reason
    actor.stop()


def test_missing_nursery_is_the_shards_reason(node: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    actor = ShardActor("w1", {}, str(tmp_path), of_node=False)
    state = seen(actor, lambda state: state.state is State.FAILED)
    assert "/nowhere/python" in state.reason
    assert not state.hopeless
    actor.stop()


def test_nursery_that_ends_early_is_tried_again(node: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "AGAIN_SECONDS", 0.001)
    tries: list[int] = []
    warm = nursery_client.NurseryClient.warm

    async def fail_at_first(self: nursery_client.NurseryClient) -> float:
        tries.append(1)
        if len(tries) == 1:
            raise NotWarm("the nursery ended with 1 before it was ready")
        return await warm(self)

    monkeypatch.setattr(nursery_client.NurseryClient, "warm", fail_at_first)
    plan = plan_fleet(1, 1, {"console": {"enabled": False}}, tmp_path, first=free_addresses(1))
    actor = ShardActor("w1", plan.shards[0].settings, str(tmp_path), of_node=False)
    assert seen(actor, is_ready).reason == ""
    assert len(tries) >= 2
    actor.stop()


def test_whole_new_lines_of_a_log_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    absent = LogTail(path)
    assert absent.read() == []
    path.write_text("old\n")
    tail = LogTail(path)
    with path.open("a") as log:
        log.write("one\ntw")
        log.flush()
        assert tail.read() == ["one"]
        log.write("o\n\xff\n")
    assert tail.read() == ["two", "\xff"]
    assert absent.read() == ["old", "one", "two", "\xff"]
    monkeypatch.setattr("roboglot.shards.states.LOG_MAX", 1)
    rotate(path)
    assert tail.read() == []
    path.write_text("new\n")
    assert tail.read() == ["new"]
