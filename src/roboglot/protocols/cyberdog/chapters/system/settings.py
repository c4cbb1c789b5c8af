"""Chapter "settings": nickname, volume, microphone, voice control, eye light, and silence (1010 to 1015, 1025).

Settings are stored with the robot; ``voice.py`` follows them.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.model.components.interaction.light import WHITE, Light, LightEffect
from roboglot.model.components.interaction.speaker import SPEAKER, Speaker
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import ComponentMissing
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.system.stored_settings import (
    MICROPHONE,
    NICKNAME,
    NICKNAME_ON,
    VOICE_CONTROL,
    WAKE_WORD,
)
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.text import Int32

NAME_MAX = 64  # characters of a nickname or a wake word
EYES = "eyes"
BRIGHTEST = 100
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=NAME_MAX)]


@TABLE.on(Code.SWITCH_NICKNAME, right=Right.EDIT, needs=(Settings,))
async def switch_nickname(call: Call, *, enable: bool) -> dict[str, bool]:
    """Use the nickname, or the factory name."""
    await call.context.robot[Settings].put(NICKNAME_ON, enable)
    return {"success": True}


@TABLE.on(Code.SET_NICKNAME, right=Right.EDIT, needs=(Settings,))
async def set_nickname(call: Call, *, nick_name: Name, wake_name: str = "") -> dict[str, bool]:
    """Set the nickname and the wake word; without one, the wake word is a short name said twice."""
    if len(wake_name) > NAME_MAX:
        return call.refused({"success": False}, f"wake_name has more than {NAME_MAX} characters")
    wake_word = wake_name or (nick_name * 2 if len(nick_name) <= 3 else nick_name)
    await call.context.robot[Settings].put_all({NICKNAME: nick_name, WAKE_WORD: wake_word, NICKNAME_ON: True})
    return {"success": True}


@TABLE.on(Code.SET_VOLUME, right=Right.EDIT, needs=(Speaker,))
async def set_volume(call: Call, *, volume: Int32) -> dict[str, bool]:
    """Set the volume, 0 (silent) to 100; true once it is stored."""
    if not 0 <= volume <= 100:
        return call.refused({"success": False}, "volume is 0 to 100")
    await call.context.robot[Speaker].set_volume(volume / 100.0)
    return {"success": True}


@TABLE.on(Code.SET_MICROPHONE, right=Right.EDIT, needs=(Hearing, Settings))
async def set_microphone(call: Call, *, enable: bool) -> dict[str, bool]:
    """Switch the voice board's microphone; voice control and voiceprints need it."""
    call.context.robot.require(Hearing)
    await call.context.robot[Settings].put(MICROPHONE, enable)
    call.context.voice.adapt()
    return {"success": True}


@TABLE.on(Code.SET_VOICE_CONTROL, right=Right.EDIT, needs=(Hearing, Settings))
async def set_voice_control(call: Call, *, enable: bool) -> dict[str, bool]:
    """Switch voice control: the wake word, and the commands after it."""
    call.context.robot.require(Hearing)
    await call.context.robot[Settings].put(VOICE_CONTROL, enable)
    call.context.voice.adapt()
    return {"success": True}


@TABLE.on(Code.SET_EYE_LIGHT, right=Right.EDIT, needs=(Light,))
async def set_eye_light(call: Call, *, eyelight: Int32) -> dict[str, bool]:
    """Set the brightness of the eyes, 0 (dark) to 100; the manual gives no range."""
    light = call.context.robot[Light]
    if EYES not in light.zones:
        raise ComponentMissing(Light)
    if not 0 <= eyelight <= BRIGHTEST:
        return call.refused({"success": False}, f"eyelight is 0 to {BRIGHTEST}")
    light.shine(EYES, WHITE.dimmed(eyelight / BRIGHTEST), LightEffect.SOLID)
    return {"success": True}


@TABLE.on(Code.STOP_SOUND, right=Right.DRIVE, needs=(Speaker,))
async def stop_sound(call: Call) -> dict[str, bool]:
    """Stop the sound of any client."""
    call.context.robot.require(Speaker)
    await call.context.robot.actions.cancel(resource=SPEAKER, reason="silenced by the app")
    return {}
