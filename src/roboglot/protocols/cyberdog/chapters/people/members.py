"""Chapter "members": people whom the robot knows (1020 to 1024).

``success`` is true or false as in the manual; in the profile of real robots it is a number, 0 for success.
"""

from __future__ import annotations

from collections.abc import Awaitable

from roboglot.model.components.interaction.members import Member, Members
from roboglot.model.errors import NotFound, RobotError
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.profile import Profile
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.codes import AccountCode, Code, PrintState


@TABLE.on(Code.ADD_MEMBER, right=Right.ADMIN, needs=(Members,))
async def add_member(call: Call, *, member: str) -> dict[str, int | bool]:
    """Add a member without face and voice; 122 if the name is taken or invalid."""
    return await _changed(call, call.context.robot[Members].add(member))


@TABLE.on(Code.FIND_MEMBERS, right=Right.SEE, needs=(Members,))
async def find_members(call: Call, *, account: str = "") -> dict[str, object]:
    """Return all members, or the named one with ``code`` 0; an unknown one: ``code`` 121 only."""
    members = call.context.robot[Members]
    if not account:
        return {"code": int(AccountCode.DONE), "accounts": [_account(call.context, member) for member in members.all()]}
    try:
        found = members.get(account)
    except NotFound as error:
        return call.refused({"code": int(AccountCode.UNKNOWN)}, str(error))
    return {"code": int(AccountCode.DONE), "accounts": [_account(call.context, found)]}


@TABLE.on(Code.DELETE_MEMBER, right=Right.ADMIN, needs=(Members,))
async def delete_member(call: Call, *, member: str) -> dict[str, int | bool]:
    """Delete a member with face and voice."""
    return await _changed(call, call.context.robot[Members].remove(member))


@TABLE.on(Code.RENAME_MEMBER, right=Right.ADMIN, needs=(Members,))
async def rename_member(call: Call, *, pre_name: str, new_name: str) -> dict[str, int | bool]:
    """Rename a member, who keeps face and voice."""
    return await _changed(call, call.context.robot[Members].rename(pre_name, new_name), AccountCode.UNKNOWN)


@TABLE.on(Code.SYNCHRONISE_MEMBERS, right=Right.SEE, needs=(Members,))
async def synchronise_members(call: Call) -> dict[str, object]:
    """Return all members, as 1021 does, for the app to copy; the manual gives only the number."""
    accounts = [_account(call.context, member) for member in call.context.robot[Members].all()]
    return {"code": int(AccountCode.DONE), "accounts": accounts}


async def _changed(
    call: Call, change: Awaitable[object], unknown: AccountCode = AccountCode.DATABASE
) -> dict[str, int | bool]:
    """Return whether ``change`` succeeds, in the profile's form; ``unknown``: the code if there is no such member."""
    numbers = call.context.profile is Profile.ROBOT
    try:
        await change
    except RobotError as error:
        code = unknown if isinstance(error, NotFound) else AccountCode.DATABASE
        return call.refused({"success": int(code) if numbers else False}, str(error))
    return {"success": int(AccountCode.DONE) if numbers else True}


def _account(context: Context, member: Member) -> dict[str, object]:
    return {
        "id": member.id,
        "name": member.name,
        "face_state": _state(member.face, context.faces.entering == member.name),
        "voice_state": _state(member.voice, context.voice.training == member.name),
    }


def _state(known: bytes | None, coming: bool) -> int:
    if coming:
        return int(PrintState.BEING_ENTERED)
    return int(PrintState.NONE if known is None else PrintState.ENTERED)
