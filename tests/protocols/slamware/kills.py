"""``kill -9`` while clients write places, walls, areas, docks, tasks, maps and settings: what was acknowledged stays.

By hand: ``python tests/protocols/slamware/kills.py --kills 200``. Each client knows what it was answered, and the one
request that was under way when the robot died: only that one may be there or not. To start often and fast, the robot is
forked from a process that has imported everything, and has no other door.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import http.client
import json
import multiprocessing
import random
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

PRELOADED = ["roboglot.fleet", "roboglot.protocols.slamware.server", "roboglot.storage.database"]
START_SECONDS_MAX = 60.0
KEYS = 12  # writes of each client
KILL_AFTER = (0.02, 0.7)  # s of writing
IDLE_SECONDS_MAX = 20.0  # s that the last kill waits for a client without a write yet, on a busy machine
ARTIFACT, SLAM, DELIVERY = "/api/core/artifact/v1", "/api/core/slam/v1", "/api/delivery/v1"
MAP = "/api/multi-floor/map/v1"
State = dict[str, int]


class Refused(Exception):
    """An answer other than success."""


def serve(data: Path, ready: Connection) -> None:
    """Run the robot until it is killed."""
    from roboglot.config import RobotConfig
    from roboglot.fleet import build_fleet
    from roboglot.model.clock import RealClock
    from roboglot.protocols.slamware.config import SlamwareConfig
    from roboglot.protocols.slamware.server import SlamwareDoor
    from roboglot.storage.database import Database

    async def live() -> None:
        database, clock = Database(data), RealClock()
        fleet = build_fleet("empty", [RobotConfig(name="a")], clock=clock, seed=1, database=database)
        door = SlamwareDoor(fleet.robots["a"], "127.0.0.1", SlamwareConfig(port=0))
        await door.start()
        await fleet.start(wait=False)
        ready.send(door.port)
        await asyncio.Event().wait()

    asyncio.run(live())


@contextlib.contextmanager
def running(data: Path) -> Iterator[tuple[ForkServerProcess, int]]:
    """Yield the robot's process and the port of its door; the process is dead afterwards."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=serve, args=(data, there), daemon=True)
    process.start()
    there.close()
    try:
        if not here.poll(START_SECONDS_MAX):
            raise TimeoutError("the robot did not start")
        yield process, here.recv()
    finally:
        process.kill()
        process.join()
        here.close()


class Client:
    """Client with one connection: ``client(method, path, body)`` returns the answer's JSON, None if it is empty."""

    def __init__(self, port: int) -> None:
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        self.close = self._connection.close

    def __call__(self, method: str, path: str, body: object = None) -> Any:
        self._connection.request(method, path, None if body is None else json.dumps(body))
        with self._connection.getresponse() as reply:
            data = reply.read()
        if reply.status not in (200, 204):
            raise Refused(f"{method} {path}: {reply.status} {data.decode()}")
        return json.loads(data) if data else None


def tagged(entries: list[Any]) -> State:
    """Lines or areas by the name in their metadata."""
    return {
        entry["metadata"]["tag"]: int(entry["metadata"]["value"]) for entry in entries if "tag" in entry["metadata"]
    }


@dataclass(slots=True)
class Writer:
    """One client: the answers that it got, its last request, and how it asks. A value of 0 means: not there."""

    keys: list[str] = field(default_factory=lambda: [f"k{number}" for number in range(KEYS)])
    known: State = field(default_factory=dict)
    flying: tuple[str, int] | None = None
    writes: int = 0
    refused: list[str] = field(default_factory=list)

    def read(self, ask: Client) -> State:
        """Return the robot's values."""
        raise NotImplementedError

    def write(self, ask: Client, key: str, value: int) -> None:
        """Add, change or remove."""
        raise NotImplementedError

    def choose(self, chance: random.Random) -> tuple[str, int]:
        """Return what to write next."""
        key = chance.choice(self.keys)
        return key, 0 if self.known.get(key) and chance.random() < 0.4 else chance.randrange(1, 1 << 30)

    def run(self, port: int, chance: random.Random) -> None:
        """Write until the robot is dead."""
        with contextlib.closing(Client(port)) as ask:
            while self.go_on(ask, chance):
                pass

    def go_on(self, ask: Client, chance: random.Random) -> bool:
        """Write once; return whether that was answered."""
        self.flying = key, value = self.choose(chance)
        try:
            self.write(ask, key, value)
        except (OSError, http.client.HTTPException):
            return False
        except Refused as refused:
            self.refused.append(str(refused))
            return False
        self.known[key], self.flying = value, None
        self.writes += 1
        return True

    def check(self, ask: Client) -> list[str]:
        """Return deviations from the acknowledged state; afterwards the robot is believed."""
        found, problems = self.read(ask), []
        for key in self.known.keys() | found.keys():
            was, now = self.known.get(key, 0), found.get(key, 0)
            if now != was and (key, now) != self.flying:
                problems.append(f"{type(self).__name__} {key}: {was} was acknowledged, {now} is there ({self.flying})")
        self.known, self.flying = found, None
        return problems


class Places(Writer):
    """Points of interest."""

    def read(self, ask: Client) -> State:
        pois = ask("GET", f"{ARTIFACT}/pois")
        return {poi["id"]: int(poi["metadata"]["value"]) for poi in pois if poi["id"].startswith("k")}

    def write(self, ask: Client, key: str, value: int) -> None:
        metadata = {"display_name": key, "value": str(value)}
        if not value:
            ask("DELETE", f"{ARTIFACT}/pois/{key}")
        elif self.known.get(key):
            ask("PUT", f"{ARTIFACT}/pois/{key}", {"metadata": metadata})
        else:
            ask("POST", f"{ARTIFACT}/pois", {"id": key, "pose": {"x": 1, "y": 2}, "metadata": metadata})


class Walls(Writer):
    """Lines; the robot numbers them."""

    path = f"{ARTIFACT}/lines/walls"
    several = True

    def shape(self) -> dict[str, Any]:
        return {"start": {"x": 50, "y": 50}, "end": {"x": 51, "y": 50}}

    def read(self, ask: Client) -> State:
        return tagged(ask("GET", self.path))

    def write(self, ask: Client, key: str, value: int) -> None:
        numbers = {entry["metadata"].get("tag"): entry["id"] for entry in ask("GET", self.path)}
        entry = {**self.shape(), "metadata": {"tag": key, "value": str(value)}}
        if not value:
            ask("DELETE", f"{self.path}/{numbers[key]}")
        elif key in numbers:
            self.change(ask, {**entry, "id": numbers[key]})
        else:
            ask("POST", self.path, [entry] if self.several else entry)

    def change(self, ask: Client, entry: dict[str, Any]) -> None:
        ask("PUT", self.path, [entry])


class Areas(Walls):
    """Rectangles."""

    path = f"{ARTIFACT}/rectangle-areas/dangerous_area"
    several = False

    def shape(self) -> dict[str, Any]:
        return {"area": {"start": {"x": 60, "y": 60}, "end": {"x": 61, "y": 60}, "half_width": 0.5}}

    def change(self, ask: Client, entry: dict[str, Any]) -> None:
        ask("PUT", f"{self.path}/{entry['id']}", entry)


class Docks(Writer):
    """Charging docks."""

    def read(self, ask: Client) -> State:
        docks = ask("GET", f"{SLAM}/homedocks")
        return {dock["id"]: int(dock["metadata"]["value"]) for dock in docks if "value" in dock["metadata"]}

    def write(self, ask: Client, key: str, value: int) -> None:
        metadata = {"display_name": key, "value": str(value)}
        if not value:
            ask("DELETE", f"{SLAM}/homedocks/{key}")
        else:
            ask("POST", f"{SLAM}/homedocks", {"id": key, "pose": {"x": 3, "y": 4}, "metadata": metadata})


class Tasks(Writer):
    """Deliveries that wait, one for each target; 1: it waits."""

    def prepare(self, ask: Client) -> None:
        """Hold the robot, and draw the targets."""
        ask("PUT", f"{DELIVERY}/tasks/:task_execution", {"enable_task_execution": False})
        for key in self.keys:
            metadata = {"display_name": f"target {key}", "type": "ROOM"}
            ask("POST", f"{ARTIFACT}/pois", {"id": f"target-{key}", "pose": {"x": 1, "y": 1}, "metadata": metadata})

    def waiting(self, ask: Client) -> dict[str, str]:
        tasks = ask("GET", f"{DELIVERY}/tasks")
        return {task["task"]["target"].removeprefix("target "): task["task"]["order_id"] for task in tasks}

    def read(self, ask: Client) -> State:
        if ask("PUT", f"{DELIVERY}/tasks/:task_execution")["enable_task_execution"]:
            raise Refused("the robot is no longer held")
        return dict.fromkeys(self.waiting(ask), 1)

    def choose(self, chance: random.Random) -> tuple[str, int]:
        key = chance.choice(self.keys)
        return key, 1 - self.known.get(key, 0)

    def write(self, ask: Client, key: str, value: int) -> None:
        if value:
            request = {"location": {"poi_name": f"target {key}"}, "type": "GUIDE", "cargos": []}
            if not (reply := ask("POST", f"{DELIVERY}/tasks", request))["result"]:
                raise Refused(str(reply))
        else:
            ask("DELETE", f"{DELIVERY}/tasks/orders/{self.waiting(ask)[key]}")


class Settings(Writer):
    """Waiting time of a meal, s; and the strategy."""

    def read(self, ask: Client) -> State:
        careful = ask("GET", "/api/core/motion/v1/strategies/:current") == "careful"
        seconds = ask("GET", f"{DELIVERY}/settings")["delivery_settings"]["timeout_settings"]["food_pickup_timeout"]
        return {"strategy": 1 + careful, "seconds": seconds}

    def choose(self, chance: random.Random) -> tuple[str, int]:
        return chance.choice((("strategy", chance.randrange(1, 3)), ("seconds", chance.randrange(10, 600))))

    def write(self, ask: Client, key: str, value: int) -> None:
        if key == "seconds":
            ask("PUT", f"{DELIVERY}/settings/timeout", {"food_pickup_timeout": value})
        else:
            strategy = ("default", "careful")[value - 1]
            ask("PUT", "/api/core/motion/v1/strategies/:current", {"strategy": strategy})


class Maps(Writer):
    """The map on disk, as the place says that was drawn on it before it was saved."""

    def read(self, ask: Client) -> State:
        names = (poi["poi_name"] for poi in ask("GET", f"{MAP}/pois"))
        return {"map": max((int(name.removeprefix("map ")) for name in names if name.startswith("map ")), default=0)}

    def choose(self, _chance: random.Random) -> tuple[str, int]:
        return "map", self.known.get("map", 0) + 1

    def write(self, ask: Client, _key: str, value: int) -> None:
        metadata = {"display_name": f"map {value}"}
        ask("POST", f"{ARTIFACT}/pois", {"id": "map", "pose": {"x": 0, "y": 0}, "metadata": metadata})
        ask("POST", f"{MAP}/stcm/:sync")


def run(kills: int, seed: int, folder: Path) -> list[str]:
    """Kill the robot ``kills`` times; return what was not stored as it had been acknowledged."""
    chance, problems, began = random.Random(seed), list[str](), time.monotonic()
    tasks = Tasks()
    writers = [Places(), Walls(), Areas(), Docks(), tasks, Settings(), Maps()]
    for number in range(kills + 1):
        with running(folder / "roboglot.db") as (process, port):
            with contextlib.closing(Client(port)) as ask:
                if not number:
                    tasks.prepare(ask)
                    for writer in writers:
                        writer.known = writer.read(ask)
                for writer in writers:
                    problems += [f"kill {number}: {problem}" for problem in writer.check(ask)]
            if number < kills:
                write_and_kill(writers, process, port, chance, IDLE_SECONDS_MAX if number == kills - 1 else 0.0)
        if number and number % 10 == 0:
            writes = {type(writer).__name__: writer.writes for writer in writers}
            print(f"{number} kills, {time.monotonic() - began:.0f} s, {writes}", flush=True)
    idle = [type(writer).__name__ for writer in writers if not writer.writes]
    refused = [text for writer in writers for text in writer.refused]
    return [*problems, *refused, *(f"{name} wrote nothing" for name in idle)]


def write_and_kill(
    writers: list[Writer], process: ForkServerProcess, port: int, chance: random.Random, patience: float
) -> None:
    """Let all write at once; after a while, when all have written or ``patience`` (s) is over, kill the robot."""
    threads = [threading.Thread(target=writer.run, args=(port, random.Random(chance.random()))) for writer in writers]
    for thread in threads:
        thread.start()
    time.sleep(chance.uniform(*KILL_AFTER))
    end = time.monotonic() + patience
    while time.monotonic() < end and not all(writer.writes for writer in writers):
        time.sleep(0.02)
    process.kill()
    for thread in threads:
        thread.join()


def main() -> None:
    """Kill, compare, print."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        problems = run(options.kills, options.seed, Path(folder))
    print("\n".join(problems) or "nothing acknowledged was lost")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
