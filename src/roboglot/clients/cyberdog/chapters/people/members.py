"""Chapter "members": 1020 to 1024."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, check
from roboglot.clients.cyberdog.values import Member
from roboglot.wire.cyberdog.codes import AccountCode, Code


class _Members(msgspec.Struct):
    accounts: list[Member] = []
    code: int = 0


class Members(Calls):
    """The robot's members."""

    async def add_member(self, name: str) -> None:
        """1020: add a member."""
        await self._member(Code.ADD_MEMBER, {"member": name})

    async def members(self) -> Sequence[Member]:
        """1021: return all members."""
        return (await self.ask(Code.FIND_MEMBERS, _Members, {"account": ""})).accounts

    async def member(self, name: str) -> Member:
        """1021: return one member. Raises CyberDogRefused (121)."""
        found = await self.ask(Code.FIND_MEMBERS, _Members, {"account": name})
        if found.code or not found.accounts:
            raise CyberDogRefused(Code.FIND_MEMBERS.name, found.code, "unknown")
        return found.accounts[0]

    async def remove_member(self, name: str) -> None:
        """1022: remove a member."""
        await self._member(Code.DELETE_MEMBER, {"member": name})

    async def synchronise_members(self) -> Sequence[Member]:
        """1023: synchronise members. The text has only the number; real robots answer nothing (NoAnswer)."""
        return (await self.ask(Code.SYNCHRONISE_MEMBERS, _Members)).accounts

    async def rename_member(self, name: str, new: str) -> None:
        """1024: rename a member."""
        await self._member(Code.RENAME_MEMBER, {"pre_name": name, "new_name": new})

    async def _member(self, code: Code, params: dict[str, object]) -> None:
        check(code, await self.ask(code, dict[str, object], params), AccountCode)
