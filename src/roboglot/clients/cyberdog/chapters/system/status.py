"""Chapter "status": 1001, 10001, 55001."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from roboglot.clients.cyberdog.calls import Calls
from roboglot.wire.cyberdog.codes import Code

TOPICS = (
    "version", "sn", "nick_name", "volume", "mic_state", "voice_control", "wifi", "bat_info", "motor_temper",
    "audio_state", "device_model", "stand", "lowpower_control",
)  # fmt: skip


class Status(Calls):
    """Status of the robot."""

    async def information(self, *topics: str, uid: str = "") -> Mapping[str, Any]:
        """1001: return the named TOPICS (all, if none is named), in the robot's own form."""
        asked = {f"is_{topic}": True for topic in topics or TOPICS}
        return await self.ask(Code.DEVICE_INFO, dict, {**asked, "uid": uid})

    async def status(self) -> Mapping[str, Any]:
        """10001: return the states that are also in the heartbeat."""
        return await self.ask(Code.STATUS, dict)

    async def disconnect_app(self) -> None:
        """55001: make the robot forget this app until its next request."""
        await self.text(Code.DISCONNECT_APP)
