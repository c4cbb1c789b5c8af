"""Chapter "members": people whom the robot knows (1020 to 1024).

``success`` is true or false as in the manual; in the profile of real robots it is a number, 0 for success.
"""

from __future__ import annotations

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
    members = call.context.robot[Members]
    try:
        await members.add(member)
    except RobotError:
        return _done(call.context, AccountCode.DATABASE)
    return _done(call.context, AccountCode.DONE)


@TABLE.on(Code.FIND_MEMBERS, right=Right.SEE, needs=(Members,))
async def find_members(call: Call, *, account: str = "") -> dict[str, object]:
    """Return all members, or the named one with ``code`` 0; an unknown one: ``code`` 121 only."""
    members = call.context.robot[Members]
    if not account:
        return {"code": int(AccountCode.DONE), "accounts": [_account(call.context, member) for member in members.all()]}
    try:
        found = members.get(account)
    except NotFound:
        return {"code": int(AccountCode.UNKNOWN)}
    return {"code": int(AccountCode.DONE), "accounts": [_account(call.context, found)]}


@TABLE.on(Code.DELETE_MEMBER, right=Right.ADMIN, needs=(Members,))
async def delete_member(call: Call, *, member: str) -> dict[str, int | bool]:
    """Delete a member with face and voice."""
    members = call.context.robot[Members]
    try:
        await members.remove(member)
    except NotFound:
        return _done(call.context, AccountCode.DATABASE)
    return _done(call.context, AccountCode.DONE)


@TABLE.on(Code.RENAME_MEMBER, right=Right.ADMIN, needs=(Members,))
async def rename_member(call: Call, *, pre_name: str, new_name: str) -> dict[str, int | bool]:
    """Rename a member, who keeps face and voice."""
    members = call.context.robot[Members]
    try:
        await members.rename(pre_name, new_name)
    except NotFound:
        return _done(call.context, AccountCode.UNKNOWN)
    except RobotError:
        return _done(call.context, AccountCode.DATABASE)
    return _done(call.context, AccountCode.DONE)


@TABLE.on(Code.SYNCHRONISE_MEMBERS, right=Right.SEE, needs=(Members,))
async def synchronise_members(call: Call) -> dict[str, object]:
    """Return all members, as 1021 does, for the app to copy; the manual gives only the number."""
    accounts = [_account(call.context, member) for member in call.context.robot[Members].all()]
    return {"code": int(AccountCode.DONE), "accounts": accounts}


def _done(context: Context, code: AccountCode) -> dict[str, int | bool]:
    """Return success or failure in the profile's form."""
    return {"success": int(code) if context.profile is Profile.ROBOT else code is AccountCode.DONE}


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
