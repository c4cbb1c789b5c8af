"""Two-way synchronisation of entries (places, drawings) between a robot and this program.

Local changes made without a link are sent when it is back. If both sides changed an entry, the robot's version wins,
unless the entry was only moved there, as all are when a robot clears its map: then a removal here holds, and so does
another name or type given here. An entry that was added or moved here meanwhile has coordinates of the old map. The
entries of both sides are merged when the program starts. Independent of the type of the entries.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Collection, Hashable, Mapping, Sequence
from contextlib import asynccontextmanager
from itertools import islice
from typing import Generic, Protocol, TypeVar

from roboglot.drivers.supervisor import Supervisor
from roboglot.model.events import Event
from roboglot.model.robot import Robot

T = TypeVar("T")
ENTRIES_MAX = 10_000  # taken over from a robot


class EntryStore(Protocol[T]):
    """Entries by key. The robot's store raises ClientError."""

    async def read(self) -> Mapping[Hashable, T]: ...
    async def write(self, put: Sequence[T], gone: Sequence[T]) -> Collection[Hashable]:
        """Write the changes and return the keys of refused entries."""


class LocalStore(EntryStore[T], Protocol[T]):
    """The local store, which logs its errors, and leaves entries alone that have changed since it was read."""

    def moves(self, before: Mapping[Hashable, T], now: Mapping[Hashable, T]) -> Mapping[Hashable, Hashable]:
        """Return the keys of entries that are now elsewhere but the same otherwise, with their new keys."""

    def merge(self, here: T, before: T, there: T) -> T | None:
        """Return the entry with an edit made here and the move made there; None: it was moved on both sides."""


class EntrySync(Generic[T]):
    """Keeps ``near`` (local) and ``far`` (robot) equal. ``changed`` is the event of a local change."""

    def __init__(
        self,
        robot: Robot,
        supervisor: Supervisor,
        near: LocalStore[T],
        far: EntryStore[T],
        changed: type[Event],
        *,
        what: str,
    ) -> None:
        self._supervisor, self._near, self._far, self._what = supervisor, near, far, what
        self._agreed: Mapping[Hashable, T] = {}
        self._lock = asyncio.Lock()
        self._syncing = self._due = False
        robot.events.listen(changed, self._changed)

    async def sync(self) -> None:
        """Synchronise once. Raises ClientError. Entries that one side refuses stay on the other and are retried."""
        async with self._lock:
            self._due = False
            far, near = dict(islice((await self._far.read()).items(), ENTRIES_MAX)), await self._near.read()
            moves = self._near.moves(self._agreed, far)
            there = self._wanted(near, far, moves)
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
            # Changed here meanwhile, unless written: the next sync has the robot follow.
            changed = {key for key, entry in near.items() if now.get(key) != entry}
            changed |= {new for old, new in moves.items() if old in changed and old not in now}
            agreed = {k: e for k, e in there.items() if (now.get(k) == e or k in changed) and k not in refused}
            self._agreed = {key: agreed[key] for key in {**far, **agreed} if key in agreed}  # in the robot's order

    def _wanted(
        self, near: Mapping[Hashable, T], far: Mapping[Hashable, T], moves: Mapping[Hashable, Hashable]
    ) -> dict[Hashable, T]:
        """Return the entries that both sides are to have."""
        before = self._agreed
        wanted = {**before, **_changes(near, before), **_changes(far, before)}
        for old, new in moves.items():
            if old not in near:
                wanted[new] = None
            elif old == new and near[old] != before[old]:
                wanted[new] = self._near.merge(near[old], before[old], far[new]) or far[new]
        return {key: entry for key, entry in wanted.items() if entry is not None}

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
            self._supervisor.send_aside(f"synchronising {self._what}", self.sync())


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
