"""Two-way synchronisation of entries (places, drawings) between a robot and this program.

Local changes made without a link are sent when it is back. If both sides changed an entry, the robot's version wins,
unless it was removed here and only moved there, as all are when a robot clears its map. The entries of both sides are
merged when the program starts. Independent of the type of the entries.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Collection, Hashable, Mapping, Sequence
from contextlib import asynccontextmanager
from itertools import islice
from typing import Generic, Protocol, TypeVar

from roboglot.drivers.supervisor import Supervisor
from roboglot.model.events import Event
from roboglot.model.robot import Robot

T = TypeVar("T")
ENTRIES_MAX = 10_000  # taken over from a robot
# Keys of entries that are now elsewhere but the same otherwise, with their new keys.
Moves = Callable[[Mapping[Hashable, T], Mapping[Hashable, T]], Mapping[Hashable, Hashable]]


class EntryStore(Protocol[T]):
    """Entries by key. The robot's store raises ClientError, the local one logs its errors."""

    async def read(self) -> Mapping[Hashable, T]: ...
    async def write(self, put: Sequence[T], gone: Sequence[T]) -> Collection[Hashable]:
        """Write the changes and return the keys of refused entries."""


class EntrySync(Generic[T]):
    """Keeps ``near`` (local) and ``far`` (robot) equal. ``changed`` is the event of a local change."""

    def __init__(
        self,
        robot: Robot,
        supervisor: Supervisor,
        near: EntryStore[T],
        far: EntryStore[T],
        changed: type[Event],
        *,
        what: str,
        moves: Moves[T],
    ) -> None:
        self._supervisor, self._near, self._far, self._what, self._moves = supervisor, near, far, what, moves
        self._agreed: Mapping[Hashable, T] = {}
        self._lock = asyncio.Lock()
        self._syncing = self._due = False
        robot.events.listen(changed, self._changed)

    async def sync(self) -> None:
        """Synchronise once. Raises ClientError. Entries that one side refuses stay on the other and are retried."""
        async with self._lock:
            self._due = False
            far, near = dict(islice((await self._far.read()).items(), ENTRIES_MAX)), await self._near.read()
            wanted = {**self._agreed, **_changes(near, self._agreed), **_changes(far, self._agreed)}
            for old, new in self._moves(self._agreed, far).items():
                if old not in near:
                    wanted[new] = None
            there = {key: entry for key, entry in wanted.items() if entry is not None}
            refused: Collection[Hashable] = ()
            if there != far:
                refused = await self._far.write(*_difference(far, there))
            self._syncing = True
            try:
                if there != near:
                    await self._near.write(*_difference(near, there))
            finally:
                self._syncing = False
            now = await self._near.read()
            agreed = {key: e for key, e in there.items() if now.get(key) == e and key not in refused}
            self._agreed = {key: agreed[key] for key in {**far, **agreed} if key in agreed}  # in the robot's order

    @asynccontextmanager
    async def forgotten(self) -> AsyncIterator[None]:
        """Context in which the robot loses its entries; the next sync merges both sides as at the start."""
        async with self._lock:
            try:
                yield
            finally:
                self._agreed = {}

    def _changed(self, _: Event) -> None:
        if not (self._syncing or self._due or self._supervisor.link.refusal):
            self._due = True  # one pending sync covers all changes until it begins
            self._supervisor.send(f"synchronising {self._what}", self.sync())


def _changes(now: Mapping[Hashable, T], before: Mapping[Hashable, T]) -> dict[Hashable, T | None]:
    """Return the changed entries by key; None stands for a removed one."""
    changed: dict[Hashable, T | None] = {key: entry for key, entry in now.items() if before.get(key) != entry}
    return changed | dict.fromkeys(before.keys() - now.keys())


def _difference(before: Mapping[Hashable, T], after: Mapping[Hashable, T]) -> tuple[list[T], list[T]]:
    """Return the entries to put and the entries to remove."""
    return (
        [entry for key, entry in after.items() if before.get(key) != entry],
        [entry for key, entry in before.items() if key not in after],
    )
