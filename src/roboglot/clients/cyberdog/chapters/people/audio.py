"""Chapter "audio": the voice board's account (3001, 3002), voiceprints (3011 to 3014)."""

from __future__ import annotations

import msgspec

from roboglot.clients.cyberdog.calls import Calls
from roboglot.wire.cyberdog.codes import Code


class Identity(msgspec.Struct):
    """Identity of the device that requests the voice board's account."""

    did: str
    sn: str


class Audio(Calls):
    """The voice board."""

    async def audio_identity(self) -> Identity:
        """3001: return the device's identity."""
        return await self.ask(Code.AUDIO_IDENTITY, Identity)

    async def set_audio_token(self, uid: str, access: str, fresh: str, expires_in: int) -> None:
        """3002: set the account's token; ``expires_in``: s."""
        token = {"uid": uid, "token_access": access, "token_fresh": fresh, "token_expires_in": str(expires_in)}
        await self.do(Code.AUDIO_TOKEN, token)

    async def train_voice(self, member: str, voiceprint: str) -> None:
        """3011: train a member's voice; the result is pushed (VoiceTrained)."""
        await self.do(Code.TRAIN_VOICE, {"nick_name": member, "voiceprint_id": voiceprint})

    async def cancel_voice(self) -> None:
        """3012: cancel the training of a voice."""
        await self.do(Code.CANCEL_VOICE)

    async def send_voiceprints(self, data: str) -> None:
        """3014: send the voiceprints that the robot asked for (VoiceprintsWanted)."""
        await self.text(Code.VOICEPRINTS, {"voiceprints_data": data})
