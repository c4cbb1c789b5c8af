"""A fleet on several Ray nodes of this machine: a killed node's robots run elsewhere, none of them twice."""

from __future__ import annotations

import asyncio
import errno
import importlib
import inspect
import os
import signal
import time
from collections.abc import Iterator
from concurrent.futures import Future
from functools import partialmethod
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest

pytest.importorskip("ray", reason="Ray, which roboglot's extra `fleet` brings, is not installed")

os.environ["RAY_AUTH_MODE"] = "disabled"  # no token in the home folder
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

import ray
from ray.cluster_utils import Cluster

from roboglot.shards import cluster as cluster_module
from roboglot.shards.actor import Condition
from roboglot.shards.cluster import ClusterFleet, _answer, refuse_unfenced
from roboglot.shards.joining import joined
from roboglot.shards.messages import Beat, Ready, Refusal
from roboglot.shards.plan import plan_fleet
from roboglot.shards.ray_processes import RayProcesses
from roboglot.shards.states import State, detached_on
from roboglot.storage.opening import open_registry
from roboglot.storage.robot_registry import Claim, RobotRegistry
from roboglot.testing.addresses import free_addresses, free_port
from tests.shards.children import child

STORE = 80 << 20
PATIENCE = 300.0  # s
AGENTS_PORTS = "metrics_agent_port", "metrics_export_port", "dashboard_agent_listen_port", "runtime_env_agent_port"
FIRST = free_addresses(4)
HEALTH = {  # a node that no longer listens counts as gone after 2 s; one that answers late on a busy machine does not
    "health_check_initial_delay_ms": 1000,
    "health_check_period_ms": 1000,
    "health_check_timeout_ms": 60_000,
    "health_check_failure_threshold": 2,
}
# Ray's own threads leave sockets and files to the collector.
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have Ray wait for its nodes as long as they take.

    A node registers when its two agents, programs in Python, are up: ten seconds of a processor on a quiet machine. Ray
    gives up after 30 s, and a raylet ends itself when it does not know its agents' ports after 15 s, both of which a
    busy machine takes. So the ports are chosen, and written where agents report them, before they start.
    """
    from ray._private import services

    persist_port = importlib.import_module("ray._raylet").persist_port  # its stubs lack it
    get_node, start_raylet = services.get_node, services.start_raylet

    def found(address: str, node: str) -> object:
        end = time.monotonic() + PATIENCE
        while True:
            try:
                return get_node(address, node)
            except RuntimeError:
                if time.monotonic() > end:
                    raise

    def start(*places: object, **named: object) -> object:
        given = inspect.signature(start_raylet).bind(*places, **named).arguments
        for name in AGENTS_PORTS:
            given[name] = port = free_port()
            persist_port(given["session_dir"], given["node_id"], name, port)
        return start_raylet(**given)

    monkeypatch.setattr(services, "get_node", found)
    monkeypatch.setattr(services, "start_raylet", start)
    monkeypatch.setattr(Cluster, "_wait_for_node", partialmethod(Cluster._wait_for_node, timeout=PATIENCE))


@pytest.fixture
def cluster(patience: None) -> Iterator[Cluster]:
    """A head without room for shards, and two nodes with room for all."""
    head = {"num_cpus": 0, "object_store_memory": STORE, "include_dashboard": False, "_system_config": HEALTH}
    made = Cluster(initialize_head=True, head_node_args=head)
    yield made
    made.shutdown()


def claims(registry: Path) -> dict[str, Claim]:
    database = open_registry(str(registry))
    try:
        return asyncio.run(RobotRegistry(database).all())
    finally:
        database.close()


@pytest.mark.slow
@pytest.mark.timeout(3 * PATIENCE)
async def test_killed_nodes_robots_run_elsewhere_and_none_twice(cluster: Cluster, tmp_path: Path) -> None:
    registry = tmp_path / "registry.db"
    nodes = {n.node_id[:12]: n for n in (cluster.add_node(num_cpus=1, object_store_memory=STORE) for _ in range(2))}
    template = {"registry": str(registry), "console": {"enabled": False}}
    plan = plan_fleet(2, 1, template, tmp_path, first=FIRST)
    (tmp_path / "fleet").mkdir()
    with joined(cluster.address):
        fleet = ClusterFleet(plan, tmp_path / "fleet", cluster.address)
        try:
            await fleet.start()
            await fleet.shards.settle()  # it has waited for 90 s, which two busy cores take
            states = {(shard.state, shard.reason) for shard in fleet.shards.values()}
            assert states == {(State.READY, "")}
            before = await asyncio.to_thread(claims, registry)
            where = {name: fleet._nodes.get(name, "") for name in fleet.shards}
            victim = where["w1"]
            began = time.monotonic()
            cluster.remove_node(nodes[victim], allow_graceful=False)
            moved = [shard for name, shard in fleet.shards.items() if where[name] == victim]
            await fleet.shards.until(
                lambda: all(s.state is State.READY and fleet._nodes.get(s.plan.name) != victim for s in moved)
            )
            print(f"robots of a killed node are back after {time.monotonic() - began:.1f} s")
            after = await asyncio.to_thread(claims, registry)
            for shard in fleet.shards.values():
                (robot,) = shard.plan.robots
                lost = where[shard.plan.name] == victim
                assert after[robot].epoch == before[robot].epoch + lost
                assert (after[robot].holder != before[robot].holder) == lost
        finally:
            await fleet.close()
    assert not ray.is_initialized()


async def test_late_answer_of_a_shard_is_dropped() -> None:
    answer = Future[bytes]()
    reference = type("Reference", (), {"future": lambda _: answer})()
    asking = asyncio.ensure_future(_answer(reference))
    await asyncio.sleep(0)
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    answer.set_result(b"")  # raises if the future was cancelled, too


def test_a_cluster_without_a_registry_is_refused(tmp_path: Path) -> None:
    plan = plan_fleet(1, 1, {}, tmp_path, first=FIRST)
    with pytest.raises(ValueError, match="needs `database` or `registry`"):
        refuse_unfenced(plan, "ray://head")


class FakeRay(SimpleNamespace):
    """Stand-in for Ray: named actors, which are up at once."""

    def __init__(self, *names: str) -> None:
        super().__init__(names=list(names), util=SimpleNamespace(list_named_actors=lambda: list(self.names)))
        self.failure: Exception | None = None
        self.refusal: Refusal | None = None
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
        ready, beat = (Ready({}), Beat(1.0, 1, 1.0)) if self.refusal is None else (None, None)
        condition = Condition(1, "node", 7, ready is not None, ready is not None, ready, beat, self.refusal, ["a line"])
        answer.set_result(msgspec.json.encode(condition))
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


async def test_a_shard_that_cannot_start_is_logged_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Its actor goes on, since another try would fail, too, and reports the same at each look."""
    fake = FakeRay()
    fake.refusal = Refusal("no body is named 'herms'", lasting=True)
    monkeypatch.setattr(cluster_module, "ray", fake)
    monkeypatch.setattr(cluster_module, "PERIOD", 0.001)
    fleet = ClusterFleet(plan_fleet(1, 1, {}, tmp_path), tmp_path, "local")
    await fleet.start()
    async with asyncio.timeout(PATIENCE):
        while fake.looks < 10:  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.001)
    assert (fleet.shards["w1"].state, fleet.shards["w1"].hopeless) == (State.FAILED, True)
    assert caplog.messages == ["shard w1 did not start: no body is named 'herms'"]
    await fleet.close()


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
