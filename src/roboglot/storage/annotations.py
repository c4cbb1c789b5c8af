"""Map annotations in the database: one JSON document per robot, with a copy in memory for reading."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import msgspec

from roboglot.model.clock import Clock
from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.events import AnnotationsChanged, EventStream
from roboglot.storage.transactions import Connection, Transactions

KINDS = "lines", "areas", "docks", "landmarks"  # fields of annotations that hold entries with ids


class StoredAnnotations(MapAnnotations):
    """The annotations of one robot."""

    def __init__(self, database: Transactions, robot: str, clock: Clock, events: EventStream) -> None:
        self._database = database
        self._robot = robot
        self._clock = clock
        self._events = events
        self.turn = asyncio.Lock()
        row = database.run_now(lambda c: c.execute("SELECT body FROM annotations WHERE robot=?", (robot,)).fetchone())
        self._current = msgspec.json.decode(row[0], type=Annotations) if row else Annotations()

    @property
    def current(self) -> Annotations:
        return self._current

    async def change(self, edit: Callable[[Annotations], Annotations]) -> None:
        async with self.turn:
            changed = edit(self._current)
            write = self._database.remove if _fewer(changed, self._current) else self._database.run
            await write(self.writing(changed))
            self.adopt(changed)

    def writing(self, changed: Annotations) -> Callable[[Connection], object]:
        """Return the transaction that writes annotations; call with ``turn`` held. Raises InvalidGoal for too many."""
        changed.check_limits(self._current)
        body = msgspec.json.encode(changed).decode()
        return lambda connection: connection.execute(
            "INSERT INTO annotations (robot, body) VALUES (?, ?) ON CONFLICT (robot) DO UPDATE SET body=excluded.body",
            (self._robot, body),
        )

    def adopt(self, changed: Annotations) -> None:
        """Adopt written annotations, and publish the change."""
        self._current = changed
        self._events.publish(AnnotationsChanged(stamp=self._clock.time()))


def _fewer(changed: Annotations, before: Annotations) -> bool:
    """Return whether a change removes annotations, and neither adds nor alters any."""
    was = {(name, entry.id): entry for name in KINDS for entry in getattr(before, name)}
    entries = [((name, entry.id), entry) for name in KINDS for entry in getattr(changed, name)]
    return len(entries) < len(was) and all(was.get(key) == entry for key, entry in entries)
