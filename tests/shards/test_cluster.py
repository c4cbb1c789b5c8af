"""A fleet on a stand-in for Ray: its shards' actors, what they report, and the end of Ray."""

from __future__ import annotations

import asyncio
import errno
import os
import signal
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest

pytest.importorskip("ray", reason="Ray, which roboglot's extra `fleet` brings, is not installed")

os.environ["RAY_AUTH_MODE"] = "disabled"  # no token in the home folder
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

import ray
from ray.exceptions import RayTaskError

from roboglot.extras import own_version
from roboglot.shards import cluster as cluster_module
from roboglot.shards.actor import Condition
from roboglot.shards.cluster import ClusterFleet, _answer, refuse_unfenced
from roboglot.shards.joining import joined
from roboglot.shards.messages import Beat, Ready, Refusal
from roboglot.shards.plan import plan_fleet
from roboglot.shards.ray_processes import RayProcesses
from roboglot.shards.states import State, detached_on
from roboglot.testing.addresses import free_addresses
from tests.shards.children import child

PATIENCE = 300.0  # s
FIRST = free_addresses(4)
# Ray's own threads leave sockets and files to the collector.
pytestmark = pytest.mark.filterwarnings("ignore")


async def test_late_answer_of_a_shard_is_dropped() -> None:
    answer = Future[bytes]()
    reference = type("Reference", (), {"future": lambda _: answer})()
    asking = asyncio.ensure_future(_answer(reference))
    await asyncio.sleep(0)
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    answer.set_result(b"")  # raises if the future was cancelled, too


async def test_restarts_of_shards_and_actors_are_counted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "local")
    shard = fleet.shards["w1"]
    counts = []
    for run, restarts in ((7, 1), (7, 1), (7, 3), (9, 0), (9, 0), (9, 1), (5, 2)):
        fleet._seen(shard, condition_of(State.READY, run=run, restarts=restarts))
        counts.append(shard.restarts)
    assert counts == [1, 1, 3, 4, 4, 5, 8]
    assert caplog.messages == ["shard w1 restarted on node"] * 4


async def test_quick_restart_is_noticed(tmp_path: Path) -> None:
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "local")
    shard = fleet.shards["w1"]
    fleet._seen(shard, condition_of(State.READY))
    waiting = asyncio.create_task(fleet.shards.until(lambda: shard.restarts == 1))
    await asyncio.sleep(0.0)
    fleet._seen(shard, condition_of(State.READY, restarts=1))
    await asyncio.wait_for(waiting, PATIENCE)


async def test_doors_are_those_of_the_shards_last_start(tmp_path: Path) -> None:
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "local")
    shard = fleet.shards["w1"]
    fleet._seen(shard, condition_of(State.READY))
    known = msgspec.structs.replace(condition_of(State.READY), ready=None)
    fleet._seen(shard, known)
    assert shard.ready == Ready({})
    fleet._seen(shard, condition_of(State.FAILED, restarts=1, reason="killed by SIGKILL"))
    assert (shard.ready, shard.reason, shard.hopeless) == (None, "killed by SIGKILL", False)
    assert fleet._seen_last["w1"].birth != known.birth


def test_a_cluster_without_a_registry_is_refused(tmp_path: Path) -> None:
    plan = plan_fleet(1, 1, {}, tmp_path, first=FIRST)
    with pytest.raises(ValueError, match="needs `database` or `registry`"):
        refuse_unfenced(plan, "ray://head")


def condition_of(
    state: State, *, run: int = 7, restarts: int = 0, reason: str = "", hopeless: bool = False
) -> Condition:
    return Condition(
        pid=1,
        node="node",
        run=run,
        restarts=restarts,
        state=state,
        silent=0.0,
        ready=Ready({}) if state is State.READY else None,
        beat=Beat(1.0, 1, 1.0),
        reason=reason,
        hopeless=hopeless,
        lines=["a line"],
        version=own_version(),
    )


class FakeRay(SimpleNamespace):
    """Stand-in for Ray: named actors, which are up at once."""

    def __init__(self, *names: str) -> None:
        super().__init__(names=list(names), util=SimpleNamespace(list_named_actors=lambda: list(self.names)))
        self.failure: Exception | None = None
        self.refusal: Refusal | None = None
        self.foreign: bytes | Exception = b""  # answer of another version of roboglot
        self.looks = 0

    def remote(self, _: type) -> FakeRay:
        return self

    def options(self, *, name: str, **_: object) -> SimpleNamespace:
        return SimpleNamespace(remote=lambda *_, **__: self.get_actor(name))

    def get_actor(self, name: str) -> SimpleNamespace:
        if name not in self.names:
            self.names.append(name)
        call = SimpleNamespace(remote=self._answer)
        return SimpleNamespace(name=name, look=call, stop=call)

    def kill(self, actor: SimpleNamespace, *, no_restart: bool) -> None:
        assert no_restart
        self.names.remove(actor.name)

    def _answer(self, *_: int) -> SimpleNamespace:
        if self.failure is not None:
            raise self.failure
        answer = Future[bytes]()
        self.looks += 1
        if isinstance(self.foreign, Exception):
            answer.set_exception(self.foreign)
            return SimpleNamespace(future=lambda: answer)
        condition = condition_of(State.READY)
        if self.refusal is not None:
            condition = condition_of(State.FAILED, reason=self.refusal.reason, hopeless=self.refusal.lasting)
        answer.set_result(self.foreign or msgspec.json.encode(condition))
        return SimpleNamespace(future=lambda: answer)


async def test_shards_of_an_earlier_plan_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Detached ones would go on with their old settings under the new plan's names."""
    fake = FakeRay("another:w1:1234")
    monkeypatch.setattr(cluster_module, "ray", fake)

    async def up(worlds: int, first: str, folder: Path = tmp_path) -> list[str]:
        fleet = ClusterFleet(plan_fleet(worlds, 1, {}, folder, first=first), folder, "ray://head", lasting=True)
        await fleet.start()
        await fleet.close()
        return sorted(fake.names)

    old = await up(3, "127.16.5.1")
    assert len(old) == 4
    assert await up(3, "127.16.5.1") == old, "the same ones"
    new = await up(2, "127.16.5.1")
    assert len(new) == 3
    assert {*new} < {*old}, "those with the same settings"
    assert {*await up(2, "127.16.6.1")} & {*new} == {"another:w1:1234"}
    (tmp_path / "of another fleet").mkdir()
    assert len(await up(2, "127.16.6.1", tmp_path / "of another fleet")) == 5


@pytest.mark.parametrize(("where", "left"), [("ray://head", ""), ("local", "ray://head")])
async def test_detached_shards_are_known_until_ended(
    where: str, left: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "ray", FakeRay())
    for cluster, lasting, known in (("ray://head", True, "ray://head"), (where, False, left)):
        fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, cluster, lasting=lasting)
        await fleet.start()
        assert detached_on(tmp_path) == "ray://head"
        await fleet.close()
        assert detached_on(tmp_path) == known


@pytest.mark.parametrize("lasting", [False, True])
async def test_a_shard_that_cannot_start_is_logged_once(
    lasting: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Its actor goes on, since another try would fail, too, and reports the same at each look."""
    fake = FakeRay()
    fake.refusal = Refusal("no body is named 'herms'", lasting=lasting)
    monkeypatch.setattr(cluster_module, "ray", fake)
    monkeypatch.setattr(cluster_module, "PERIOD", 0.001)
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "ray://head", lasting=lasting)
    await fleet.start()
    async with asyncio.timeout(PATIENCE):
        while fake.looks < 10:  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.001)
    assert (fleet.shards["w1"].state, fleet.shards["w1"].hopeless) == (State.FAILED, lasting)
    assert caplog.messages == ([] if lasting else ["shard w1 did not start: no body is named 'herms'"])
    assert fake.names
    await fleet.close()
    assert (fake.names, detached_on(tmp_path)) == ([], ""), "no detached shard stays that cannot start"


@pytest.mark.parametrize("part", ["raylet", "gcs_server"])
async def test_a_lost_ray_ends_the_fleet(part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray itself would report that its only node is gone after a minute, and never start another."""
    monkeypatch.setattr(cluster_module, "ray", FakeRay())
    monkeypatch.setattr(cluster_module, "PERIOD", 0.001)
    with child("log_monitor") as beside, child(part) as process:
        fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "local")
        await fleet.start()
        beside.kill()
        beside.wait()
        assert not fleet.ended.done()
        process.kill()
        with pytest.raises(OSError, match=f"^{part}, a process of Ray, has ended, and Ray with it; start again$"):
            await asyncio.wait_for(fleet.ended, PATIENCE)
        await fleet.close()


def test_ray_that_was_never_started_has_lost_nothing() -> None:
    assert RayProcesses().why_lost() == ""


def test_earlier_ray_that_ended_is_not_ours() -> None:
    with child("raylet") as process:
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # it stays, as no one has asked for its status
        assert RayProcesses().why_lost() == ""


@pytest.mark.parametrize("kind", ["joins", "works", "ends"])
def test_rays_reports_leave_the_output_alone(
    kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ray prints errors of its processes, with a dump of their state, on standard output."""
    report = {kind: lambda **_: print("(raylet) [state-dump]")}
    monkeypatch.setattr(ray, "init", report.get("joins", lambda **_: None))
    monkeypatch.setattr(ray, "shutdown", report.get("ends", lambda: None))
    with joined("local"):
        report.get("works", lambda: None)()
    print("ready")
    assert capsys.readouterr() == ("ready\n", "(raylet) [state-dump]\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_another_signal_does_not_disturb_rays_end(number: signal.Signals, monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[str] = []
    monkeypatch.setattr(ray, "init", lambda **_: None)

    def shut_down() -> None:
        os.kill(os.getpid(), number)
        ended.append("whole")

    monkeypatch.setattr(ray, "shutdown", shut_down)
    before = signal.getsignal(number)
    with joined("local"):
        pass
    assert ended == ["whole"]
    assert signal.getsignal(number) is before


@pytest.mark.parametrize(
    "failure", [Exception("Ray Client is not connected"), OSError(errno.ENOSPC, "No space left on device", "log")]
)
async def test_a_failed_look_is_not_the_last(
    failure: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    fake = FakeRay()
    monkeypatch.setattr(cluster_module, "ray", fake)
    monkeypatch.setattr(cluster_module, "PERIOD", 0.001)
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "local")
    await fleet.start()
    shard, failures = fleet.shards["w1"], 0

    def fail(*_: object) -> None:
        nonlocal failures
        failures += 1
        raise failure

    monkeypatch.setattr(cluster_module, "_keep", fail)
    fake.failure = None if isinstance(failure, OSError) else failure
    async with asyncio.timeout(10.0):
        while "looking at shard w1: " not in caplog.text:  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.001)
        fake.failure = None
        fleet.shards.turn_to(shard, State.STARTING)
        await fleet.shards.until(lambda: shard.state is State.READY)
    assert len([record for record in caplog.records if record.levelname == "WARNING"]) == 1
    await fleet.close()
    assert fake.names == []


MISSING = RayTaskError("look", "a traceback", TypeError("look() takes 1 positional argument but 2 were given"))


@pytest.mark.parametrize(
    ("foreign", "runs"),
    [
        (b'{"version": "0.3.1", "pid": 1}', f"runs roboglot 0.3.1, not {own_version()}"),
        (b'{"pid": 1}', "runs another version of roboglot"),
        (b"\x80", "runs another version of roboglot"),
        (MISSING, "runs another version of roboglot"),
        (TypeError("too many arguments"), "runs another version of roboglot"),
    ],
)
async def test_shard_of_another_version_is_named(
    foreign: bytes | Exception,
    runs: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    fake = FakeRay()
    fake.foreign = foreign
    monkeypatch.setattr(cluster_module, "ray", fake)
    monkeypatch.setattr(cluster_module, "PERIOD", 0.001)
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "ray://head", lasting=True)
    await fleet.start()
    shard, looks = fleet.shards["w1"], fake.looks
    async with asyncio.timeout(PATIENCE):
        while fake.looks < looks + 5:  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.001)
    why = f"it {runs}; restart it: `roboglot fleet restart w1`"
    assert (shard.state, shard.reason, shard.hopeless) == (State.FAILED, why, False)
    assert caplog.messages == [f"shard w1 cannot be served: {why}"]
    fake.foreign = b""
    await fleet.restart(shard)
    assert (shard.state, shard.reason) == (State.READY, "")
    await fleet.close()


async def test_slow_actor_is_missed_not_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its supervisor had no time to answer."""
    fake = FakeRay()
    monkeypatch.setattr(cluster_module, "ray", fake)
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "local")
    await fleet.start()
    fake.foreign = RayTaskError("look", "a traceback", TimeoutError())
    await fleet._look(fleet.shards["w1"])
    assert fleet.shards["w1"].state is State.STARTING
    assert fleet.shards["w1"].reason.startswith("it does not answer; Ray starts it again")
    fake.foreign = b""
    await fleet.close()
