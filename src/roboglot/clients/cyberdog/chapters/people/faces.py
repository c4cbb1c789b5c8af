"""Chapter "faces": 7001 and 7002."""

from __future__ import annotations

from roboglot.clients.cyberdog.calls import Calls
from roboglot.wire.cyberdog.codes import Code


class Faces(Calls):
    """Members' faces."""

    async def enter_face(self, member: str, *, host: bool = False) -> None:
        """7001: begin entering a face; the result is pushed (FaceEntered)."""
        await self.do(Code.ENTER_FACE, {"command": 0, "username": member, "oriname": "", "ishost": host})

    async def change_faces(self, command: int, member: str, former: str = "") -> None:
        """7001 with another of the robot's commands: 1 cancel, 2 confirm, 3 update, 4 delete, 5 list."""
        await self.do(Code.ENTER_FACE, {"command": command, "username": member, "oriname": former, "ishost": False})

    async def recognise_faces(self, member: str = "", *, id: int = 0, seconds: int = 60) -> None:
        """7002: recognise any member, or the given one; FaceRecognised is pushed."""
        params = {"command": 1 if member else 0, "username": member, "id": id, "timeout": seconds}
        await self.do(Code.RECOGNISE_FACES, params)
