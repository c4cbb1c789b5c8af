"""Chapter "audio": the voice board's account (3001, 3002), voiceprints (3011 to 3014).

This door does not talk to the maker's cloud: of a token, only whose it is and until when it holds are kept.
"""

from __future__ import annotations

import uuid

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot
from roboglot.operations import BadParameters, Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.system.stored_settings import ACCOUNT, VOICEPRINTS, kept
from roboglot.protocols.cyberdog.table import TABLE, push
from roboglot.wire.cyberdog.codes import Code

TRAINED = push(Code.VOICE_TRAINED)
ASK_VOICEPRINTS = push(Code.VOICEPRINTS)
DEVICES = uuid.UUID("6f1d1c0e-9f55-5d0b-8a57-52f3d7a1c2b4")  # the name space of device ids
ID_MAX = 64  # characters
UID_MAX = 2**64 - 1
TOKEN_MAX = 8192
VOICEPRINTS_MAX = 65_536
LASTS_MAX = 10 * 365 * 86_400  # s


@TABLE.on(Code.AUDIO_IDENTITY, right=Right.SEE, needs=(Hearing,))
async def audio_identity(call: Call) -> dict[str, str]:
    """Return the device that asks for an account: its id (made from the serial number) and its serial number."""
    call.context.robot.require(Hearing)
    serial = call.context.robot.description.serial
    return {"did": str(uuid.uuid5(DEVICES, serial)), "sn": serial}


@TABLE.on(Code.AUDIO_TOKEN, right=Right.ADMIN, needs=(Hearing, Settings))
async def audio_token(
    call: Call,
    *,
    uid: str | int = "",
    token_access: str = "",
    token_fresh: str = "",
    token_expires_in: str | int = "",
) -> dict[str, bool]:
    """Activate the voice board for ``uid`` until the token expires (s from now); false for an expired token."""
    call.context.robot.require(Hearing)
    lasts = _seconds(token_expires_in)
    account = str(uid)
    if not (account.isascii() and account.isdecimal() and len(account) <= ID_MAX and int(account) <= UID_MAX):
        return call.refused({"result": False}, f"uid is a whole number, 0 to {UID_MAX}")
    if not token_access or lasts is None:
        return call.refused({"result": False}, "token_access and a time to live are needed")
    if max(len(token_access), len(token_fresh)) > TOKEN_MAX:
        return call.refused({"result": False}, f"a token has at most {TOKEN_MAX} characters")
    await call.context.robot[Settings].put(ACCOUNT, {"uid": account, "until": call.context.robot.clock.epoch() + lasts})
    return {"result": True}


def activated(robot: Robot, uid: str | None = None) -> bool:
    """Return whether the voice board has an account (``uid``'s, if given) with a valid token."""
    account: object = kept(robot, ACCOUNT, None)
    if Hearing not in robot or not isinstance(account, dict) or account["until"] <= robot.clock.epoch():
        return False
    return uid is None or account["uid"] == uid


@TABLE.on(Code.TRAIN_VOICE, right=Right.EDIT, needs=(Hearing, Members))
async def train_voice(call: Call, *, nick_name: str, voiceprint_id: str = "") -> dict[str, object]:
    """Learn the next speaker's voice for a member; push 3013 reports the outcome within 30 s."""
    call.context.robot.require(Hearing)
    call.context.voice.train(nick_name, voiceprint_id[:ID_MAX])
    return {}


@TABLE.on(Code.CANCEL_VOICE, right=Right.EDIT, needs=(Hearing,))
async def cancel_voice(call: Call) -> dict[str, object]:
    """Stop learning a voice."""
    call.context.robot.require(Hearing)
    call.context.voice.stop_training()
    return {}


@TABLE.on(Code.VOICEPRINTS, right=Right.EDIT, needs=(Hearing, Settings))
async def voiceprints(call: Call, *, voiceprints_data: str = "") -> str:
    """Store the app's answer to push 3014. Robots recognise people by voices that they learned themselves."""
    call.context.robot.require(Hearing)
    if len(voiceprints_data) > VOICEPRINTS_MAX:
        raise BadParameters(f"voiceprints_data has up to {VOICEPRINTS_MAX} characters")
    await call.context.robot[Settings].put(VOICEPRINTS, voiceprints_data)
    return ""


def _seconds(value: str | int) -> int | None:
    """Return a time to live, also one in decimal digits; None: there is none, or it is too long."""
    text = str(value)
    is_whole = text.isascii() and text.isdecimal() and len(text) <= ID_MAX
    return int(text) if is_whole and 0 < int(text) <= LASTS_MAX else None
