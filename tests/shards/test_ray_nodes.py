"""A fleet on several Ray nodes of this machine: those of a killed one run elsewhere, those of one share a nursery."""

from __future__ import annotations

import asyncio
import importlib
import inspect
import os
import signal
import time
from collections.abc import Iterator
from functools import partialmethod
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("ray", reason="Ray, which roboglot's extra `fleet` brings, is not installed")

os.environ["RAY_AUTH_MODE"] = "disabled"  # no token in the home folder
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

import ray
from ray.cluster_utils import Cluster

from roboglot.hosting.process import has_ended, running
from roboglot.shards.cluster import ClusterFleet
from roboglot.shards.joining import joined
from roboglot.shards.plan import plan_fleet
from roboglot.shards.states import LOG_FILE, State
from roboglot.storage.opening import open_registry
from roboglot.storage.robot_registry import Claim, RobotRegistry
from roboglot.testing.addresses import free_addresses, free_port

STORE = 80 << 20
PATIENCE = 300.0  # s
AGENTS_PORTS = "metrics_agent_port", "metrics_export_port", "dashboard_agent_listen_port", "runtime_env_agent_port"
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
    plan = plan_fleet(2, 1, template, tmp_path, first=free_addresses(2))
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


def actors_of(node: object) -> set[int]:
    """Processes of shards' actors on a node."""
    (raylet,) = node.all_processes["raylet"]  # type: ignore[attr-defined]
    found = (one.pid for one in running() if one.parent == raylet.process.pid and not one.has_ended)
    return {pid for pid in found if Path(f"/proc/{pid}/cmdline").read_bytes().startswith(b"ray::ShardActor")}


def has_robot_code(process: int) -> bool:
    """True if a process has loaded libraries of robots. Ray itself may load uvloop, and NumPy by pyarrow."""
    maps = Path(f"/proc/{process}/maps").read_text()
    return any(name in maps for name in ("mujoco", "llvmlite"))


def nursery_of(shard: int) -> int:
    """The nursery from which a shard was forked, by a process that serves its supervisor."""
    parents = {one.pid: one.parent for one in running()}
    return parents[parents[shard]]


def process_of(actor: Any) -> int:
    """The process of an actor."""
    pid: int = ray.get(actor.__ray_call__.remote(lambda _: os.getpid()))
    return pid


@pytest.mark.slow  # in short: test_killed_shard_returns_from_its_nodes_nursery
@pytest.mark.timeout(3 * PATIENCE)
async def test_shards_of_a_node_share_its_nursery(cluster: Cluster, tmp_path: Path) -> None:
    node = cluster.add_node(num_cpus=1, object_store_memory=STORE)
    template = {"registry": str(tmp_path / "registry.db"), "console": {"enabled": False}}
    plan = plan_fleet(2, 1, template, tmp_path, first=free_addresses(2))
    (tmp_path / "fleet").mkdir()
    with joined(cluster.address):
        fleet = ClusterFleet(plan, tmp_path / "fleet", cluster.address)
        first, second = fleet.shards.values()

        async def until_ready(restarts: int = 0) -> None:
            """It restarts once more if its predecessor still closes."""
            await fleet.shards.until(
                lambda: all(s.state is State.READY for s in (first, second)) and first.restarts >= restarts
            )

        try:
            await fleet.start()
            await until_ready()
            actors, nursery, alone = actors_of(node), nursery_of(first.pid), second.pid
            assert len(actors) == 2
            assert nursery_of(second.pid) == nursery
            assert not [pid for pid in actors if has_robot_code(pid)]
            os.kill(first.pid, signal.SIGKILL)
            await until_ready(1)
            assert (actors_of(node), nursery_of(first.pid), second.pid) == (actors, nursery, alone)
            restarts = first.restarts
            actor = await asyncio.to_thread(process_of, fleet._actors["w1"])
            os.kill(actor, signal.SIGKILL)
            await until_ready(restarts + 1)
            assert len(actors_of(node) - actors) == 1
            assert (nursery_of(first.pid), second.pid) == (nursery, alone)
            async with asyncio.timeout(PATIENCE):
                while "can map and navigate" not in (first.folder / LOG_FILE).read_text():  # noqa: ASYNC110 - as below
                    await asyncio.sleep(0.05)
        finally:
            await fleet.close()
    cluster.remove_node(node, allow_graceful=False)
    async with asyncio.timeout(PATIENCE):
        while not has_ended(nursery):  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.05)
