"""Claim: a coordinator that receives the heartbeats of 10,000 robots takes <= 10 % of a core.

100 programs of 100 simulated robots each, in separate processes: they send the supervisor's heartbeats once a
second, and renew their robots' registry on PostgreSQL twice a second, as shards do. This process is the coordinator: it
receives the heartbeats and watches the registry. With Ray installed, another part queries actors of Ray instead, 100
times a second, as `fleet up --on` does. Processor time is measured, so that a busy machine changes little; that of the
registry's server is printed beside it.

    scripts/bench heartbeats [--programs 100] [--robots-each 100] [--seconds 20]
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import socket
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from typing import cast

from _claim import Claims

sys.path.insert(0, str(Path(__file__).parents[2]))  # the tests' PostgreSQL server

from roboglot.shards.messages import Beat, Ready, encode, pair
from roboglot.shards.plan import FleetPlan, plan_fleet
from roboglot.shards.states import State
from roboglot.shards.supervisor import Supervisor
from roboglot.storage.dead_programs import DeadProgramWatch
from roboglot.storage.opening import open_registry
from roboglot.storage.registry_lease import RegistryLease
from roboglot.storage.robot_registry import RobotRegistry
from tests.storage.postgresql_server import binary_folder, postgresql_server

TICKS = os.sysconf("SC_CLK_TCK")
READY = b"r"
BEAT = 1.0  # s between two heartbeats of a shard
CONNECTIONS = 4  # connections of all simulated programs: a server's default limit is 100


def used_by(command: str) -> float:
    """Processor time of all processes of that name so far, s."""
    total = 0
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, values = file.read_text().partition(" (")[2].rpartition(") ")
        except OSError:
            continue
        if name == command:
            total += sum(int(value) for value in values.split()[11:13])
    return total / TICKS


def ready_of(plan: FleetPlan, number: int) -> Ready:
    """Message of a shard with all its doors when it is up."""
    robots = plan.shards[number].settings["robots"]
    doors = [("Slamware", "1448"), ("RoboMaster", "40923"), ("CyberDog", "50052"), ("programs", "50053")]
    return Ready({robot["name"]: [(door, f"{robot['address']}:{port}") for door, port in doors] for robot in robots})


async def simulate(plan: FleetPlan, registry: str, links: list[socket.socket], up: int) -> None:
    """Run the programs: claim robots, report it, then send heartbeats and renew until the coordinator ends."""
    databases = [open_registry(registry) for _ in range(CONNECTIONS)]
    leases = []
    for number, shard in enumerate(plan.shards):
        addresses = {robot["name"]: robot["address"] for robot in shard.settings["robots"]}
        shared = RobotRegistry(databases[number % CONNECTIONS])
        leases.append(RegistryLease(shared, addresses, f"program {number}", lambda _: None))
        await leases[-1].acquire()
    logging.disable(logging.ERROR)
    await asyncio.gather(*(lease.renew() for lease in leases))  # the first ones took theirs a while ago
    logging.disable(logging.NOTSET)
    for number, (link, lease) in enumerate(zip(links, leases, strict=True)):
        link.send(encode(ready_of(plan, number)))
        lease.start_renewing()
    os.write(up, READY)
    turn = 0
    while True:
        link = links[turn % len(links)]
        link.send(encode(Beat(1.0, 35 << 20, turn / 100)))  # raises if the coordinator has ended
        turn += 1
        await asyncio.sleep(BEAT / len(links))


class Listening(Supervisor):
    """A supervisor whose shards are there already."""

    def adopt(self, links: list[socket.socket]) -> None:
        """Hear them, and look after them as ever."""
        for shard, link in zip(self.shards.values(), links, strict=True):
            link.setblocking(False)
            shard.link = link
            self._loop.add_reader(link, self._receive, shard)
            self._turn_to(shard, State.STARTING)
        self._look_after()


async def coordinate(
    claims: Claims, plan: FleetPlan, registry: str, links: list[socket.socket], seconds: float
) -> None:
    """Hear and watch for a while."""
    robots = [robot for shard in plan.shards for robot in shard.robots]
    database = open_registry(registry)
    with tempfile.TemporaryDirectory() as folder:
        supervisor = Listening(plan, Path(folder))
        supervisor.adopt(links)
        await supervisor.shards.until(lambda: all(shard.state is State.READY for shard in supervisor.shards.values()))
        watching = asyncio.create_task(DeadProgramWatch(RobotRegistry(database), robots).run())
        await asyncio.sleep(2.0)
        server, own, began = used_by("postgres"), time.process_time(), time.monotonic()
        await asyncio.sleep(seconds)
        passed = time.monotonic() - began
        own, server = (time.process_time() - own) / passed, (used_by("postgres") - server) / passed
        watching.cancel()
        late = max(asyncio.get_running_loop().time() - shard.heard for shard in supervisor.shards.values())
        registered = await RobotRegistry(database).all()
    database.close()
    held = sum(claim.holder != "" and claim.epoch == 1 for claim in registered.values())
    print(f"{len(plan.shards)} programs with {held} of {len(robots)} robots; the oldest heartbeat is {late:.2f} s old")
    print(f"the registry's server takes {server:.3f} cores for {2 * len(plan.shards)} renewals and 2 looks a second")
    claims.at_least("robots still at home", held, len(robots), "robots")
    claims.at_most("coordinator of heartbeats", own * 100, 10.0, "% of a core")
    claims.at_most("with the registry's server", (own + server) * 100, 10.0, "% of a core")


def look_by_ray(claims: Claims, plan: FleetPlan, seconds: float) -> None:
    """Ask one actor as often as all shards would be, through the fleet's own code."""
    import ray

    from roboglot.shards.actor import Condition
    from roboglot.shards.cluster import Actor, ClusterFleet
    from roboglot.shards.joining import joined

    said = [ready_of(plan, number) for number in range(len(plan.shards))]

    class Shard:
        def look(self, known: int) -> bytes:
            import msgspec

            said_once = None if known else said[0]
            beat = Beat(1.0, 0, 0.0)
            return msgspec.json.encode(
                Condition(1, "node", 7, 0, State.READY, 0.0, said_once, beat, "", hopeless=False, lines=[], version="")
            )

        def stop(self) -> bytes:
            return b""

    class Asking(ClusterFleet):
        async def _begin(self, shard: object) -> None:
            self._actors[shard.plan.name] = actor  # type: ignore[attr-defined]
            self.shards.turn_to(shard, State.STARTING)  # type: ignore[arg-type]

    async def look() -> float:
        with tempfile.TemporaryDirectory() as folder:
            fleet = Asking(plan, Path(folder), "local", lasting=True)
            await fleet.start()
            await asyncio.sleep(2.0)
            own, began = time.process_time(), time.monotonic()
            await asyncio.sleep(seconds)
            share = (time.process_time() - own) / (time.monotonic() - began)
            await fleet.close()
        return share

    with joined("local"):
        actor = cast(Actor, ray.remote(Shard).options(max_concurrency=4, num_cpus=0).remote())
        claims.at_most("coordinator of heartbeats, on Ray", asyncio.run(look()) * 100, 10.0, "% of a core")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=int, default=100)
    parser.add_argument("--robots-each", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=20.0)
    chosen, claims = parser.parse_args(), Claims()
    plan = plan_fleet(chosen.programs, chosen.robots_each, {}, Path("/nowhere"))
    if find_spec("ray") is None:
        print("Ray is not installed: its part is left out")
    else:
        look_by_ray(claims, plan, chosen.seconds)
    binaries = binary_folder()
    if binaries is None:
        sys.exit("heartbeats: no PostgreSQL server on this machine (Debian: apt-get install postgresql)")
    with postgresql_server(binaries) as server:
        links = [pair() for _ in plan.shards]
        up, is_up = os.pipe()
        simulated = os.fork()
        if simulated == 0:
            for ours, _ in links:
                ours.close()
            try:
                asyncio.run(simulate(plan, server.url, [theirs for _, theirs in links], is_up))
            except OSError:
                pass  # the coordinator has ended
            finally:
                os._exit(0)
        for _, theirs in links:
            theirs.close()
        os.close(is_up)
        if os.read(up, 1) != READY:
            sys.exit("heartbeats: the simulated programs did not start")
        asyncio.run(coordinate(claims, plan, server.url, [ours for ours, _ in links], chosen.seconds))
        for ours, _ in links:
            ours.close()
        os.waitpid(simulated, 0)
    claims.finish()


if __name__ == "__main__":
    main()
