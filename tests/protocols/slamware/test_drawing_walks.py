"""Random walks through places and drawings: several requests at once count as if one came after the other.

What was created can be read, what was deleted is gone, lists have what items have, and no number is given twice.
"""

from __future__ import annotations

import asyncio
import copy
import itertools
import random
import threading
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot
from roboglot.model.tap import Direction, Exchange
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.database import Database
from roboglot.storage.files import StoredFiles
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings
from tests.protocols.held_fairness import PATIENCE, until
from tests.protocols.slamware.conftest import PLATE, serve
from tests.protocols.witness import Diary, walks

ROUNDS = 25
API = "/api/core/artifact/v1"
POIS, MARKS = f"{API}/pois", f"{API}/laser-landmarks"
LINES, AREAS = ("walls", "tracks"), ("forbidden_area", "maintenance_area")
KNOWN, GONE = 200, 404

Words = dict[str, Any]
State = dict[str, Any]  # "pois", "marks": entries by id; the usages: entries by number; "last": the last number given


@dataclass(frozen=True)
class Ask:
    """A request, and what it does to the state; ``does`` returns the status."""

    method: str
    path: str
    body: Any
    does: Callable[[State], int]


class Draw:
    """Draws requests about what may exist."""

    def __init__(self, draw: random.Random) -> None:
        self._draw = draw

    def ask(self, state: State) -> Ask:
        kinds = [self._place, self._place, self._line, self._area, self._marks]
        return self._draw.choice(kinds)(state)

    def _pose(self) -> Words:
        return {"x": float(self._draw.randint(0, 9)), "y": 1.0, "yaw": 0.5}

    def _words(self) -> Words:
        return {"w": str(self._draw.randint(0, 99))}

    def _strip(self) -> Words:
        return {"start": self._point(), "end": self._point(), "half_width": 0.5}

    def _point(self) -> Words:
        return {"x": float(self._draw.randint(0, 9)), "y": float(self._draw.randint(0, 9))}

    def _change(self, **values: Words) -> Words:
        """Some of the values, at least one."""
        return dict(self._draw.sample(sorted(values.items()), self._draw.randint(1, len(values))))

    def _place(self, _: State) -> Ask:
        id, kind = self._draw.choice("abc"), self._draw.random()
        if kind < 0.3:
            new = {"id": id, "pose": self._pose(), "metadata": self._words()}
            return Ask("POST", POIS, new, lambda state: _put(state["pois"], id, new))
        if kind < 0.7:
            change = self._change(pose=self._pose(), metadata=self._words())
            return Ask("PUT", f"{POIS}/{id}", change, lambda state: _merge(state["pois"], id, change))
        if kind < 0.95:
            return Ask("DELETE", f"{POIS}/{id}", None, lambda state: _remove(state["pois"], id))
        return Ask("DELETE", POIS, None, lambda state: _clear(state["pois"]))

    def _number(self, state: State) -> int:
        return self._draw.randint(max(1, state["last"] - 4), state["last"] + 1)

    def _line(self, state: State) -> Ask:
        usage, kind, number = self._draw.choice(LINES), self._draw.random(), self._number(state)
        line = {"start": self._point(), "end": self._point(), "metadata": self._words()}
        path = f"{API}/lines/{usage}"
        if kind < 0.4:
            return Ask("POST", path, [line, line], lambda state: _new(state, usage, line, line))
        if kind < 0.7:
            changed = {**line, "id": number}
            return Ask("PUT", path, [changed], lambda state: _merge(state[usage], number, changed))
        if kind < 0.95:
            return Ask("DELETE", f"{path}/{number}", None, lambda state: _remove(state[usage], number))
        return Ask("DELETE", path, None, lambda state: _clear(state[usage]))

    def _area(self, state: State) -> Ask:
        usage, kind, number = self._draw.choice(AREAS), self._draw.random(), self._number(state)
        path = f"{API}/rectangle-areas/{usage}"
        if kind < 0.4:
            new = {"area": self._strip(), "metadata": self._words()}
            return Ask("POST", path, new, lambda state: _new(state, usage, {**new, "usage": usage}))
        if kind < 0.7:
            change = self._change(area=self._strip(), metadata=self._words())
            return Ask("PUT", f"{path}/{number}", change, lambda state: _merge(state[usage], number, change))
        if kind < 0.95:
            return Ask("DELETE", f"{path}/{number}", None, lambda state: _remove(state[usage], number))
        return Ask("DELETE", path, None, lambda state: _clear(state[usage]))

    def _marks(self, _: State) -> Ask:
        if self._draw.random() < 0.5:
            marks = {id: {"id": id, "pose": self._pose(), "metadata": {}} for id in self._draw.sample("pqrs", 3)}
            return Ask("PUT", MARKS, [*marks.values()], lambda state: _replace(state["marks"], marks))
        ids = self._draw.sample("pqrs", 2)
        return Ask("POST", f"{MARKS}/:remove", ids, lambda state: _remove(state["marks"], *ids))


def _put(entries: Words, id: Any, entry: Words) -> int:
    entries[id] = entry
    return KNOWN


def _merge(entries: Words, id: Any, change: Words) -> int:
    if id not in entries:
        return GONE
    entries[id] = entries[id] | change
    return KNOWN


def _remove(entries: Words, *ids: Any) -> int:
    if any(id not in entries for id in ids):
        return GONE
    for id in ids:
        del entries[id]
    return KNOWN


def _clear(entries: Words) -> int:
    entries.clear()
    return KNOWN


def _replace(entries: Words, new: Words) -> int:
    entries.clear()
    entries.update(new)
    return KNOWN


def _new(state: State, usage: str, *entries: Words) -> int:
    for entry in entries:
        state["last"] += 1
        state[usage][state["last"]] = {**entry, "id": state["last"]}
    return KNOWN


async def _read(client: httpx.AsyncClient) -> State:
    """Return what the lists have, without the last number."""
    paths = {"pois": POIS, "marks": MARKS}
    paths |= {usage: f"{API}/lines/{usage}" for usage in LINES}
    paths |= {usage: f"{API}/rectangle-areas/{usage}" for usage in AREAS}
    lists = {name: (await client.get(path)).json() for name, path in paths.items()}
    return {name: {entry["id"]: entry for entry in entries} for name, entries in lists.items()}


def _explained(asks: list[Ask], state: State, statuses: list[int], read: State) -> State | None:
    """Return the state after the requests in an order that explains what was answered and can be read; or None."""
    for order in itertools.permutations(range(len(asks))):
        tried = copy.deepcopy(state)
        answered = {number: asks[number].does(tried) for number in order}
        if all(answered[n] == statuses[n] for n in order) and {**tried, **read} == tried:
            return tried
    return None


class Shelf:
    """A robot that has nothing but a memory, on disk, and a client of its door."""

    def __init__(self, robot: Robot, database: Database, client: httpx.AsyncClient) -> None:
        self._robot, self._database, self.client = robot, database, client
        self._arrived = 0
        robot.tap.listen(self._count)

    def _count(self, exchange: Exchange) -> None:
        self._arrived += exchange.direction is Direction.REQUEST

    async def at_once(self, asks: list[Ask]) -> list[int]:
        """Send requests that all arrive before the first is on disk; their statuses."""
        gate, arrived = threading.Event(), self._arrived + len(asks)
        held = asyncio.ensure_future(self._database.run(lambda _: gate.wait(PATIENCE)))
        sent = asyncio.gather(*(self.client.request(ask.method, ask.path, json=ask.body) for ask in asks))
        await until(lambda: self._arrived == arrived)
        for _ in range(5):  # turns of the loop in which handlers begin
            await asyncio.sleep(0)
        gate.set()
        await held
        return [KNOWN if reply.is_success else reply.status_code for reply in await sent]


@pytest.fixture
async def shelf(clock: LockstepClock, tmp_path: Path) -> AsyncIterator[Shelf]:
    robot, database = Robot("shelf", PLATE, clock), Database(tmp_path / "shelf.db")
    robot.add(Places, StoredPlaces(database, "shelf", clock, robot.events))
    robot.add(MapAnnotations, StoredAnnotations(database, "shelf", clock, robot.events))
    robot.add(FileStore, StoredFiles(database, "shelf", clock))
    robot.add(Settings, StoredSettings(database, "shelf"))
    async for door in serve(robot):
        async with httpx.AsyncClient(base_url=door.endpoints[0].address, timeout=60, verify=False) as client:
            yield Shelf(robot, database, client)
    database.close()


@pytest.mark.parametrize(("seed", "rounds"), walks(ROUNDS, 8))
async def test_requests_at_once_count_one_by_one(seed: int, rounds: int, shelf: Shelf) -> None:
    draw, diary, client = random.Random(seed), Diary(), shelf.client
    drawn = Draw(draw)
    state: State = {name: {} for name in ("pois", "marks", *LINES, *AREAS)} | {"last": 0}
    with diary.writing():
        for _ in range(rounds):
            asks = [drawn.ask(state) for _ in range(draw.randint(1, 3))]
            statuses = await shelf.at_once(asks)
            diary.extend((ask.method, ask.path, ask.body, status) for ask, status in zip(asks, statuses, strict=True))
            read = await _read(client)
            after = _explained(asks, state, statuses, read)
            assert after is not None, (read, state)
            state = after
            for id in "abc":
                reply = await client.get(f"{POIS}/{id}")
                assert (reply.json() if reply.is_success else None) == state["pois"].get(id)
