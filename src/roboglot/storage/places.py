"""Places in the database, with a copy in memory for reading."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Sequence

from roboglot.model.clock import Clock
from roboglot.model.components.mapping.places import Places
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.events import EventStream, PlacesChanged
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.storage.transactions import Connection, Transactions

PLACES_MAX = 10_000


class StoredPlaces(Places):
    """The places of one robot."""

    def __init__(self, database: Transactions, robot: str, clock: Clock, events: EventStream) -> None:
        self._database = database
        self._robot = robot
        self._clock = clock
        self._events = events
        self.turn = asyncio.Lock()  # of changes
        self._places = {place.id: place for place in database.run_now(self._load)}

    def all(self) -> Sequence[PointOfInterest]:
        return tuple(self._places.values())

    def get(self, id: str) -> PointOfInterest:
        try:
            return self._places[id]
        except KeyError:
            raise NotFound(f"no place {id!r}") from None

    async def put(self, *places: PointOfInterest) -> None:
        async with self.turn:
            await self._database.run(self.writing(places))
            self._places |= {place.id: place for place in places}
        self._publish()

    async def modify(self, id: str, edit: Callable[[PointOfInterest], PointOfInterest]) -> None:
        async with self.turn:
            place = edit(self.get(id))
            await self._database.run(self.writing([place]))
            self._places[id] = place
        self._publish()

    async def change(self, edit: Callable[[Sequence[PointOfInterest]], Sequence[PointOfInterest]]) -> None:
        async with self.turn:
            places = edit(self.all())
            fewer = all(self._places.get(place.id) == place for place in places)
            write = self._database.remove if fewer else self._database.run
            await write(self.writing(places, alone=True))
            self._places = {place.id: place for place in places}
        self._publish()

    def writing(self, places: Sequence[PointOfInterest], *, alone: bool = False) -> Callable[[Connection], object]:
        """Return the transaction that writes places; ``alone``: replace all others. Raises InvalidGoal for too many."""
        new = {place.id: place for place in places}
        if len(new if alone else self._places.keys() | new.keys()) > PLACES_MAX:
            raise InvalidGoal(f"more than {PLACES_MAX} places")
        rows = [(self._robot, p.id, p.pose.x, p.pose.y, p.pose.yaw, json.dumps(dict(p.metadata))) for p in new.values()]

        def work(connection: Connection) -> None:
            if alone:
                connection.execute("DELETE FROM place WHERE robot=?", (self._robot,))
            connection.executemany(
                "INSERT INTO place (robot, id, x, y, yaw, metadata) VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT (robot, id)"
                " DO UPDATE SET x=excluded.x, y=excluded.y, yaw=excluded.yaw, metadata=excluded.metadata",
                rows,
            )

        return work

    def adopt(self, places: Sequence[PointOfInterest]) -> None:
        """Replace all places by written ones."""
        self._places = {place.id: place for place in places}
        self._publish()

    async def remove(self, id: str) -> None:
        async with self.turn:
            self.get(id)
            await self._database.remove(
                lambda c: c.execute("DELETE FROM place WHERE robot=? AND id=?", (self._robot, id))
            )
            self._places.pop(id, None)
        self._publish()

    async def clear(self) -> None:
        async with self.turn:
            await self._database.remove(lambda c: c.execute("DELETE FROM place WHERE robot=?", (self._robot,)))
            self._places.clear()
        self._publish()

    def _load(self, connection: Connection) -> list[PointOfInterest]:
        rows = connection.execute(
            "SELECT id, x, y, yaw, metadata FROM place WHERE robot=? ORDER BY seq", (self._robot,)
        )
        return [PointOfInterest(id, Pose(x, y, yaw), json.loads(metadata)) for id, x, y, yaw, metadata in rows]

    def _publish(self) -> None:
        self._events.publish(PlacesChanged(stamp=self._clock.time()))
