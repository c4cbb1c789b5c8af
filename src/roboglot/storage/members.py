"""The robot's members in the database, with a copy in memory for reading."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Sequence

from roboglot.model.clock import Clock
from roboglot.model.components.interaction.members import MEMBERS_MAX, NAME_MAX, PRINT_MAX, Member, Members
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.events import EventStream, MembersChanged
from roboglot.storage.transactions import AlreadyThere, Connection, Transactions


class StoredMembers(Members):
    """The members of one robot."""

    def __init__(self, database: Transactions, robot: str, clock: Clock, events: EventStream) -> None:
        self._database, self._robot, self._clock, self._events = database, robot, clock, events
        self._turn = asyncio.Lock()  # of changes: each reads what the one before it stored
        self._members = {member.name: member for member in database.run_now(self._load)}

    def all(self) -> Sequence[Member]:
        return sorted(self._members.values(), key=lambda member: member.id)

    def get(self, name: str) -> Member:
        try:
            return self._members[name]
        except KeyError:
            raise NotFound(f"no member is named {name!r}") from None

    async def add(self, name: str, *, host: bool = False) -> Member:
        def insert(connection: Connection) -> int:
            ((id,),) = connection.execute(
                "INSERT INTO member (robot, name, host) VALUES (?, ?, ?) RETURNING id", (self._robot, name, int(host))
            ).fetchall()
            return int(id)

        async with self._turn:
            self._check_free(name)
            if len(self._members) >= MEMBERS_MAX:
                raise InvalidGoal(f"more than {MEMBERS_MAX} members")
            try:
                id = await self._database.run(insert)
            except AlreadyThere:  # added by another program
                raise InvalidGoal(f"there is a member named {name!r} already") from None
            return self._keep(Member(id, name, host))

    async def rename(self, name: str, new: str) -> Member:
        async with self._turn:
            member = self.get(name)
            if new == name:
                return member
            self._check_free(new)
            try:
                await self._update(member, "name", new)
            except AlreadyThere:
                raise InvalidGoal(f"there is a member named {new!r} already") from None
            self._members.pop(name)
            return self._keep(dataclasses.replace(member, name=new))

    async def remove(self, name: str) -> None:
        async with self._turn:
            member = self.get(name)
            await self._database.remove(lambda c: c.execute("DELETE FROM member WHERE id=?", (member.id,)))
            self._members.pop(name)
            self._publish()

    async def set_face(self, name: str, face: bytes | None) -> Member:
        async with self._turn:
            member = await self._set_print(name, "face", face)
            return self._keep(dataclasses.replace(member, face=face))

    async def set_voice(self, name: str, voice: bytes | None) -> Member:
        async with self._turn:
            member = await self._set_print(name, "voice", voice)
            return self._keep(dataclasses.replace(member, voice=voice))

    async def _set_print(self, name: str, column: str, value: bytes | None) -> Member:
        """Store a print, and return the member as before."""
        if value is not None and not 0 < len(value) <= PRINT_MAX:
            raise InvalidGoal(f"a print has 1 to {PRINT_MAX} bytes")
        member = self.get(name)
        await self._update(member, column, value)
        return member

    async def _update(self, member: Member, column: str, value: object) -> None:
        """Update one column; ``column`` is a constant of ours, never input."""
        write = self._database.remove if value is None else self._database.run
        await write(lambda c: c.execute(f"UPDATE member SET {column}=? WHERE id=?", (value, member.id)))

    def _check_free(self, name: str) -> None:
        if not name.strip() or len(name) > NAME_MAX or not name.isprintable():
            raise InvalidGoal(f"a member's name has 1 to {NAME_MAX} characters")
        if name in self._members:
            raise InvalidGoal(f"there is a member named {name!r} already")

    def _keep(self, member: Member) -> Member:
        self._members[member.name] = member
        self._publish()
        return member

    def _load(self, connection: Connection) -> list[Member]:
        rows = connection.execute(
            "SELECT id, name, host, face, voice FROM member WHERE robot=? ORDER BY id", (self._robot,)
        )
        return [Member(id, name, bool(host), face, voice) for id, name, host, face, voice in rows]

    def _publish(self) -> None:
        self._events.publish(MembersChanged(stamp=self._clock.time()))
