"""Claims: what breaks in a fleet on Ray runs no robot twice, takes none away for > 10 s, loses nothing acknowledged.

Three network namespaces of this machine are three machines: a head with PostgreSQL and `roboglot fleet up --on`, and
two nodes, each with one of the two robots. One after the other: all connections of the database are cut; its server is
away for 5 s; the clock of a node jumps by a day, and back by two; a node's network is cut; a node is killed. In each
node someone tries to drive each robot twenty times a second, and saves a place four times a second, all the while.

Needs Ray (extra `fleet`), PostgreSQL, iproute2, util-linux, a C compiler, and root, for a namespace of its own.

    scripts/bench faults
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import psycopg
from _claim import Claims
from _watcher import ROBOTS

sys.path.insert(0, str(Path(__file__).parents[2]))  # the tests' PostgreSQL server

from tests.storage.postgresql_server import PostgreSQLServer, binary_folder, postgresql_server

HEAD, GCS = "10.99.0.1", 6379
WATCHER = Path(__file__).parents[1] / "_watcher.py"
PATIENCE = 120.0
AWAY_MAX = 10.0
DAY = 86400
ALONE = "FAULTS_ALONE"
STARTED = "Ray runtime started"
SETTLED = 4.0  # s without a fault before the next one
HEALTH = {  # as in deploy/kuberay/fleet.yaml
    "RAY_health_check_initial_delay_ms": "1000",
    "RAY_health_check_period_ms": "1000",
    "RAY_health_check_timeout_ms": "1000",
    "RAY_health_check_failure_threshold": "2",
}
ENVIRONMENT = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_AUTH_MODE": "disabled",
    "RAY_worker_niceness": "0",  # as in the image
    "ROBOGLOT_INSECURE": "1",
    **HEALTH,
}
CLOCK = """
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>
static volatile long *ahead;
static long seconds(void) {
    if (!ahead) {
        int file = open(getenv("CLOCK_AHEAD"), O_RDONLY);
        ahead = mmap(0, sizeof(long), PROT_READ, MAP_SHARED, file, 0);
        close(file);
    }
    return *ahead;
}
int clock_gettime(clockid_t which, struct timespec *now) {
    int failed = syscall(SYS_clock_gettime, which, now);
    if (!failed && (which == CLOCK_REALTIME || which == CLOCK_REALTIME_COARSE)) now->tv_sec += seconds();
    return failed;
}
int gettimeofday(struct timeval *now, void *zone) {
    struct timespec precise;
    clock_gettime(CLOCK_REALTIME, &precise);
    now->tv_sec = precise.tv_sec;
    now->tv_usec = precise.tv_nsec / 1000;
    return 0;
}
time_t time(time_t *there) {
    struct timespec precise;
    clock_gettime(CLOCK_REALTIME, &precise);
    if (there) *there = precise.tv_sec;
    return precise.tv_sec;
}
"""


@dataclass(frozen=True)
class Sight:
    """Observation of a node's watcher: a robot obeyed ("drove"), or stored a place ("saved")."""

    at: float
    node: str
    robot: str
    what: str
    place: str = ""


def run(command: str) -> None:
    subprocess.run(command.split(), check=True)


class Node:
    """A machine: a network namespace with an address, and Ray in it."""

    def __init__(self, name: str, number: int, folder: Path) -> None:
        self.name, self.address, self._folder = name, f"10.99.0.{number}", folder
        self._holder = subprocess.Popen(["unshare", "-n", "sleep", "1200"])
        own = os.readlink("/proc/self/ns/net")
        while os.readlink(f"/proc/{self._holder.pid}/ns/net") == own:
            time.sleep(0.01)
        self._inside = ["nsenter", "-t", str(self._holder.pid), "-n"]
        self._link = f"to{name}"
        run(f"ip link add {self._link} type veth peer name cable netns {self._holder.pid}")
        run(f"ip link set {self._link} master bridge up")
        for command in ("ip link set lo up", f"ip addr add {self.address}/24 dev cable", "ip link set cable up"):
            subprocess.run([*self._inside, *command.split()], check=True)
        self.watcher = self.start([sys.executable, str(WATCHER), name, str(folder / f"{name}.sights")])

    def start(self, command: list[str], environment: dict[str, str] | None = None) -> subprocess.Popen[bytes]:
        """Run a program in here."""
        log = (self._folder / f"{self.name}.log").open("ab")
        whole = os.environ | (environment or {})
        return subprocess.Popen([*self._inside, *command], env=whole, stdout=log, stderr=log)

    def join(self, environment: dict[str, str] | None = None) -> None:
        """Start Ray."""
        self._said = len((self._folder / f"{self.name}.log").read_text(errors="replace"))
        where = [f"--address={HEAD}:{GCS}", f"--node-ip-address={self.address}"]
        self.start(ray("start", *where, "--num-cpus=2", "--object-store-memory=80000000"), environment)

    def has_joined(self) -> bool:
        """True if Ray has reported this since its start."""
        return STARTED in (self._folder / f"{self.name}.log").read_text(errors="replace")[self._said :]

    def cut(self, *, off: bool) -> None:
        """Take the cable out, or put it back."""
        run(f"ip link set {self._link} {'down' if off else 'up'}")

    def kill(self) -> None:
        """End every program in here but the watcher at once, as a power cut does."""
        keep = {self._holder.pid, self.watcher.pid}
        inside = os.readlink(f"/proc/{self._holder.pid}/ns/net")
        for entry in Path("/proc").glob("[0-9]*"):
            try:
                if os.readlink(entry / "ns/net") == inside and int(entry.name) not in keep:
                    os.kill(int(entry.name), signal.SIGKILL)
            except OSError:
                continue

    def close(self) -> None:
        self.kill()
        for process in (self.watcher, self._holder):
            process.kill()
            process.wait()


def ray(*words: str) -> list[str]:
    return [str(Path(sys.executable).with_name("ray")), *words, "--block"]


class Fleet:
    """The fleet under test, its nodes, and what was seen."""

    def __init__(self, folder: Path, server: PostgreSQLServer) -> None:
        self.folder, self.server = folder, server
        self.ahead = folder / "ahead"
        self.ahead.write_bytes((0).to_bytes(8, sys.byteorder, signed=True))
        (folder / "clock.c").write_text(CLOCK)
        run(f"cc -shared -fPIC -O1 -o {folder}/clock.so {folder}/clock.c")
        self.nodes = {name: Node(name, number, folder) for number, name in enumerate("bc", start=2)}
        self._jumping = {"LD_PRELOAD": f"{folder}/clock.so", "CLOCK_AHEAD": str(self.ahead)}
        self._own: list[subprocess.Popen[bytes]] = []

    def up(self) -> None:
        """Start Ray on all, and the fleet."""
        port = f"--port={GCS}"
        self._start(
            ray("start", "--head", port, f"--node-ip-address={HEAD}", "--num-cpus=0", "--dashboard-host=127.0.0.1")
        )
        self.until(lambda: _answers(HEAD, GCS), "Ray's head")
        for node, environment in ((self.nodes["b"], {}), (self.nodes["c"], self._jumping)):
            node.join(environment)
            self.until(node.has_joined, f"node {node.name}")  # two at once would take each other's sockets
        template = self.folder / "world.toml"
        template.write_text(f'database = "{self.server.url}"\n[console]\nenabled = false\n')
        words = ["fleet", "up", "--on", f"{HEAD}:{GCS}", "--worlds", "2", "--template", str(template)]
        self._start([sys.executable, "-m", "roboglot", *words, "--data", str(self.folder / "fleet")])
        self.settle(0.0)

    def _start(self, command: list[str]) -> None:
        log = (self.folder / "head.log").open("ab")
        self._own.append(subprocess.Popen(command, stdout=log, stderr=log))

    def until(self, reached: Callable[[], bool], what: str) -> None:
        """Wait for something, or end the program with all logs."""
        end = time.monotonic() + PATIENCE
        while not reached():
            if time.monotonic() > end:
                logs = "\n".join(file.read_text(errors="replace")[-1500:] for file in self.folder.glob("*.log"))
                sys.exit(f"faults: {what} is not there after {PATIENCE:g} s\n{logs}")
            time.sleep(0.2)

    def sights(self) -> Iterator[Sight]:
        """Observations of all watchers so far."""
        for name in self.nodes:
            for line in (self.folder / f"{name}.sights").read_text().splitlines():
                at, *words = line.split()
                if len(words) >= 3:
                    yield Sight(float(at), *words)

    def settle(self, since: float) -> float:
        """Wait until every robot has been driven at ``since`` or later, and then a while; return when that was."""

        def driven() -> bool:
            return {
                sight.robot for sight in self.sights() if sight.what == "drove" and sight.at >= since
            } == ROBOTS.keys()

        self.until(driven, "every robot")
        time.sleep(SETTLED)
        return time.monotonic()

    def where(self, robot: str) -> str:
        """Return the node that a robot was driven on last."""
        return max((sight for sight in self.sights() if sight.robot == robot), key=lambda sight: sight.at).node

    def cut_connections(self) -> None:
        """Cut all connections of the database: the head's and the shards'."""
        query = "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE application_name = 'roboglot'"
        with psycopg.connect(self.server.url, autocommit=True) as connection:
            print(f"    {(connection.execute(query).fetchone() or (0,))[0]} connections cut")

    def jump(self, seconds: int) -> None:
        """Set the clock of node c so far ahead."""
        with self.ahead.open("r+b") as file:  # written in place: processes have the file mapped
            file.write(seconds.to_bytes(8, sys.byteorder, signed=True))

    def stored(self) -> dict[str, set[str]]:
        """Return the places that the database has of each robot."""
        with psycopg.connect(self.server.url, autocommit=True) as connection:
            places: dict[str, set[str]] = defaultdict(set)
            for robot, place in connection.execute("SELECT robot, id FROM place"):
                places[robot].add(place)
            return places

    def close(self) -> None:
        for process in reversed(self._own):
            process.terminate()
        for process in self._own:
            try:
                process.wait(20.0)
            except subprocess.TimeoutExpired:
                process.kill()
        for node in self.nodes.values():
            node.close()


def judge(claims: Claims, fleet: Fleet, name: str, began: float, ended: float) -> None:
    """Report how long no client could drive each robot around a fault, and whether two programs obeyed."""
    for robot in ROBOTS:
        seen = sorted(
            (sight.at, sight.node)
            for sight in fleet.sights()
            if sight.robot == robot and sight.what == "drove" and began - 1.0 <= sight.at <= ended
        )
        times = [began - 1.0, *(at for at, _ in seen), ended]
        away = max(after - before for before, after in pairwise(times))
        moves = [f"{b[1]} to {a[1]}" for b, a in pairwise(seen) if a[1] != b[1]]
        claims.at_most(f"{name}: {robot} away", away, AWAY_MAX, "s")
        print(f"    {len(seen)} drives granted, moved {', '.join(moves) or 'nowhere'}")
        claims.at_most(f"{name}: {robot} returns to an old node", max(0, len(moves) - 1), 0.5, "times")


def faults(fleet: Fleet) -> Iterator[tuple[str, Callable[[], float]]]:
    """Yield the faults by name; each returns when it has passed."""

    def server_away() -> float:
        fleet.server.stop()
        time.sleep(5.0)
        fleet.server.start()
        return time.monotonic()

    def connections_cut() -> float:
        fleet.cut_connections()
        return time.monotonic()

    def clock_jumps() -> float:
        for ahead in (DAY, -DAY):
            fleet.jump(ahead)
            time.sleep(5.0)
        return time.monotonic()

    def split() -> float:
        node = fleet.nodes[fleet.where("a1")]
        node.cut(off=True)
        time.sleep(20.0)  # longer than any lease
        node.cut(off=False)
        time.sleep(10.0)  # the old program notices that its robot was taken
        node.kill()
        ended = time.monotonic()
        node.join()
        fleet.until(node.has_joined, f"node {node.name}")
        return ended

    def killed() -> float:
        fleet.nodes[fleet.where("a1")].kill()
        return time.monotonic()

    yield "connections", connections_cut
    yield "server", server_away
    yield "clock", clock_jumps
    yield "split", split
    yield "killed", killed


@contextmanager
def made() -> Iterator[Fleet]:
    """Yield the fleet; the head's machine is this namespace."""
    binaries = binary_folder()
    if binaries is None:
        sys.exit("faults: no PostgreSQL server on this machine (Debian: apt-get install postgresql)")
    os.environ.update(ENVIRONMENT)
    for command in ("link set lo up", "link add bridge type bridge", f"addr add {HEAD}/24 dev bridge"):
        run(f"ip {command}")
    run("ip link set bridge up")
    with tempfile.TemporaryDirectory(prefix="faults") as folder, postgresql_server(binaries, HEAD) as server:
        fleet = Fleet(Path(folder), server)
        try:
            fleet.up()
            yield fleet
        finally:
            fleet.close()


def _answers(address: str, port: int) -> bool:
    try:
        socket.create_connection((address, port), 1.0).close()
    except OSError:
        return False
    return True


def main() -> None:
    claims = Claims()
    with made() as fleet:
        for name, fault in faults(fleet):
            print(f"{name}: a1 on {fleet.where('a1')}, a2 on {fleet.where('a2')}", flush=True)
            began = time.monotonic()
            healed = fault()
            ended = fleet.settle(max(healed, began + 0.5))
            judge(claims, fleet, name, began, ended)
        saved = [sight for sight in fleet.sights() if sight.what == "saved"]
        stored = fleet.stored()  # later: the watchers go on saving
        lost = [sight for sight in saved if sight.place not in stored[sight.robot]]
        print(f"{len(saved)} places were acknowledged", *lost, sep="\n    ")
        claims.at_most("acknowledged places lost", len(lost), 0.5, "places")
    claims.finish()


def alone() -> None:
    """Go on in a network namespace of our own, where there is Ray."""
    if find_spec("ray") is None:
        sys.exit("faults: Ray is not installed: pip install 'roboglot[fleet]'")
    if ALONE not in os.environ:
        os.environ[ALONE] = "1"
        os.execvp("unshare", ["unshare", "--net", sys.executable, *sys.argv])


if __name__ == "__main__":
    alone()
    main()
