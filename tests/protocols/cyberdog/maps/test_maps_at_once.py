"""Changes of stored maps at once, by two phones and the console: they count as if one came after the other."""

from __future__ import annotations

import asyncio
import itertools
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboglot.console.verbs.maps import remove_map
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.storage.database import Database
from roboglot.storage.maps import StoredMaps
from tests.protocols.cyberdog.phone import ADDRESS, PATIENCE, Client, Messages, Pems, until
from tests.protocols.slamware.conftest import PLATE

LABELS = 6002
Change = Callable[[], Awaitable[bool]]


class Shelf:
    """A robot that has nothing but stored maps, on disk, with two phones and the console."""

    def __init__(self, robot: Robot, database: Database, phones: list[Client]) -> None:
        self.robot, self._database, self._phones = robot, database, phones
        self._arrived = 0
        robot.tap.listen(self._count)

    def _count(self, exchange: Exchange) -> None:
        self._arrived += exchange.direction is Direction.REQUEST

    async def begin(self) -> None:
        """Keep two maps, the first with two labels."""
        for name in await self.robot[MapLibrary].names():
            await self.robot[MapLibrary].remove(name)
        for name in ("attic", "cellar"):
            grid = OccupancyGrid(np.ones((4, 4), np.int8), 0.05, Point())
            await self.robot[MapLibrary].put(StoredMap(name, grid, 0.0))
        assert await self._say(0, mapName="attic", map_id=7, locationLabelInfo=[_label("bed"), _label("door")])

    async def _say(self, phone: int, **params: Any) -> bool:
        return bool(await self._phones[phone].ask(LABELS, params) == {"success": 0})

    def deleted(self, phone: int, label: str) -> Change:
        return lambda: self._say(phone, mapName="attic", only_delete=True, locationLabelInfo=[{"labelName": label}])

    def numbered(self, phone: int, name: str) -> Change:
        return lambda: self._say(phone, mapName=name, map_id=7, locationLabelInfo=[_label(name)])

    def labelled_by_number(self, phone: int) -> Change:
        return lambda: self._say(phone, map_id=7, locationLabelInfo=[_label("seven")])

    async def removed(self) -> bool:
        try:
            await remove_map(self.robot, map="attic")
        except NotFound:
            return False
        return True

    async def at_once(self, *changes: Change) -> list[bool]:
        """Begin changes that all arrive before the first is on disk; return whether each was done."""
        gate, wanted = threading.Event(), self._arrived + sum(change != self.removed for change in changes)
        held = asyncio.ensure_future(self._database.run(lambda _: gate.wait(PATIENCE)))
        asked = asyncio.gather(*(change() for change in changes))
        await until(lambda: self._arrived == wanted)
        gate.set()
        await held
        return await asked

    async def kept(self) -> dict[str, tuple[int, list[str]]]:
        """Return the number and the labels of each map."""
        library = self.robot[MapLibrary]
        maps = [await library.get(name) for name in await library.names()]
        return {map.name: (map.number, [label.name for label in map.labels]) for map in maps}


def _label(name: str) -> dict[str, object]:
    return {"labelName": name, "physicX": 0.1, "physicY": 0.1}


@pytest.fixture
async def shelf(
    clock: LockstepClock, tmp_path: Path, data: Path, pems: Pems, messages: Messages
) -> AsyncIterator[Shelf]:
    robot, database = Robot("shelf", PLATE, clock), Database(tmp_path / "shelf.db")
    robot.add(MapLibrary, StoredMaps(database, "shelf"))
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0), data)
    await door.start()
    async with pems.channel(door.port) as one, pems.channel(door.port) as other:
        yield Shelf(robot, database, [Client(one, messages), Client(other, messages)])
    await door.close()
    database.close()


@pytest.mark.slow
async def test_map_changes_at_once_count_one_by_one(shelf: Shelf) -> None:
    changes = (
        shelf.deleted(0, "bed"),
        shelf.deleted(1, "door"),
        shelf.numbered(0, "cellar"),
        shelf.numbered(1, "attic"),
        shelf.labelled_by_number(0),
        shelf.removed,
    )
    for pair in itertools.permutations(changes, 2):
        possible = []
        for order in (pair, pair[::-1]):
            await shelf.begin()
            done = {change: await change() for change in order}
            possible.append(([done[change] for change in pair], await shelf.kept()))
        await shelf.begin()
        assert (await shelf.at_once(*pair), await shelf.kept()) in possible
