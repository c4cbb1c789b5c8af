"""Chapter "settings": 1010 to 1015, 1025."""

from __future__ import annotations

from roboglot.clients.cyberdog.calls import Calls
from roboglot.wire.cyberdog.codes import Code


class Settings(Calls):
    """Persistent settings."""

    async def switch_nickname(self, on: bool) -> None:
        """1010: switch the nickname on or off."""
        await self.do(Code.SWITCH_NICKNAME, {"enable": on})

    async def set_nickname(self, name: str, wake_word: str) -> None:
        """1011: set the nickname and the wake word."""
        await self.do(Code.SET_NICKNAME, {"nick_name": name, "wake_name": wake_word})

    async def set_volume(self, percent: int) -> None:
        """1012: set the volume, percent."""
        await self.do(Code.SET_VOLUME, {"volume": percent})

    async def set_microphone(self, on: bool) -> None:
        """1013: switch the microphone."""
        await self.do(Code.SET_MICROPHONE, {"enable": on})

    async def set_voice_control(self, on: bool) -> None:
        """1014: switch control by voice."""
        await self.do(Code.SET_VOICE_CONTROL, {"enable": on})

    async def set_eye_light(self, percent: int) -> None:
        """1015: set the brightness of the eyes, percent."""
        await self.do(Code.SET_EYE_LIGHT, {"eyelight": percent})

    async def stop_sound(self) -> None:
        """1025: stop the current sound."""
        await self.do(Code.STOP_SOUND)
