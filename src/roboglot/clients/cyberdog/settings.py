"""Chapters "settings", "members", "audio", "faces", "skin": 1010 to 1025, 3001 to 3014, 7001, 7002, 11001, 11002."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, check
from roboglot.clients.cyberdog.values import Member
from roboglot.wire.cyberdog.codes import AccountCode, Code, SkinMode


class _Members(msgspec.Struct):
    accounts: list[Member] = []
    code: int = 0


class Identity(msgspec.Struct):
    """Return the device that requests the voice board's account."""

    did: str
    sn: str


class Settings(Calls):
    """Persistent settings."""

    async def switch_nickname(self, on: bool) -> None:
        """1010."""
        await self.do(Code.SWITCH_NICKNAME, {"enable": on})

    async def set_nickname(self, name: str, wake_word: str) -> None:
        """1011."""
        await self.do(Code.SET_NICKNAME, {"nick_name": name, "wake_name": wake_word})

    async def set_volume(self, percent: int) -> None:
        """1012."""
        await self.do(Code.SET_VOLUME, {"volume": percent})

    async def set_microphone(self, on: bool) -> None:
        """1013."""
        await self.do(Code.SET_MICROPHONE, {"enable": on})

    async def set_voice_control(self, on: bool) -> None:
        """1014."""
        await self.do(Code.SET_VOICE_CONTROL, {"enable": on})

    async def set_eye_light(self, percent: int) -> None:
        """1015."""
        await self.do(Code.SET_EYE_LIGHT, {"eyelight": percent})

    async def enable_skin(self, on: bool) -> None:
        """11001: the electronic skin."""
        await self.do(Code.ENABLE_SKIN, {"data": on})

    async def set_skin(self, mode: SkinMode, cycle: int = 0) -> None:
        """11002; ``cycle``: ms of a change of colour; for FOOTFALLS 0 for light legs on the floor, else dark."""
        await self.do(Code.SET_SKIN, {"mode": int(mode), "wave_cycle_time": cycle})

    async def stop_sound(self) -> None:
        """1025."""
        await self.do(Code.STOP_SOUND)

    async def add_member(self, name: str) -> None:
        """1020."""
        await self._member(Code.ADD_MEMBER, {"member": name})

    async def members(self) -> Sequence[Member]:
        """1021: all."""
        return (await self.ask(Code.FIND_MEMBERS, _Members, {"account": ""})).accounts

    async def member(self, name: str) -> Member:
        """1021: one. Raises CyberDogRefused (121)."""
        found = await self.ask(Code.FIND_MEMBERS, _Members, {"account": name})
        if found.code or not found.accounts:
            raise CyberDogRefused(Code.FIND_MEMBERS.name, found.code, "unknown")
        return found.accounts[0]

    async def remove_member(self, name: str) -> None:
        """1022."""
        await self._member(Code.DELETE_MEMBER, {"member": name})

    async def synchronise_members(self) -> Sequence[Member]:
        """1023, of which the text has the number only; robots in the field answer nothing (NoAnswer)."""
        return (await self.ask(Code.SYNCHRONISE_MEMBERS, _Members)).accounts

    async def rename_member(self, name: str, new: str) -> None:
        """1024."""
        await self._member(Code.RENAME_MEMBER, {"pre_name": name, "new_name": new})

    async def _member(self, code: Code, params: dict[str, object]) -> None:
        check(code, await self.ask(code, dict[str, Any], params), AccountCode)

    async def audio_identity(self) -> Identity:
        """3001."""
        return await self.ask(Code.AUDIO_IDENTITY, Identity)

    async def set_audio_token(self, uid: str, access: str, fresh: str, expires_in: int) -> None:
        """3002; ``expires_in`` s."""
        token = {"uid": uid, "token_access": access, "token_fresh": fresh, "token_expires_in": str(expires_in)}
        await self.do(Code.AUDIO_TOKEN, token)

    async def train_voice(self, member: str, voiceprint: str) -> None:
        """3011; VoiceTrained is pushed."""
        await self.do(Code.TRAIN_VOICE, {"nick_name": member, "voiceprint_id": voiceprint})

    async def cancel_voice(self) -> None:
        """3012."""
        await self.do(Code.CANCEL_VOICE)

    async def send_voiceprints(self, data: str) -> None:
        """3014: what the robot asked for (VoiceprintsWanted)."""
        await self.text(Code.VOICEPRINTS, {"voiceprints_data": data})

    async def enter_face(self, member: str, *, host: bool = False) -> None:
        """7001: begin; FaceEntered is pushed."""
        await self.do(Code.ENTER_FACE, {"command": 0, "username": member, "oriname": "", "ishost": host})

    async def change_faces(self, command: int, member: str, former: str = "") -> None:
        """7001 with another command: 1 cancel, 2 confirm, 3 update, 4 delete, 5 list, as the robot numbers them."""
        await self.do(Code.ENTER_FACE, {"command": command, "username": member, "oriname": former, "ishost": False})

    async def recognise_faces(self, member: str = "", *, id: int = 0, seconds: int = 60) -> None:
        """7002: recognise any member, or the given one; FaceRecognised is pushed."""
        params = {"command": 1 if member else 0, "username": member, "id": id, "timeout": seconds}
        await self.do(Code.RECOGNISE_FACES, params)
