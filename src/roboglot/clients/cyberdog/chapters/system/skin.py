"""Chapter "electronic skin": 11001 and 11002."""

from __future__ import annotations

from roboglot.clients.cyberdog.calls import Calls
from roboglot.wire.cyberdog.codes import Code, SkinMode


class Skin(Calls):
    """The electronic skin."""

    async def enable_skin(self, on: bool) -> None:
        """11001: switch the electronic skin."""
        await self.do(Code.ENABLE_SKIN, {"data": on})

    async def set_skin(self, mode: SkinMode, cycle: int = 0) -> None:
        """11002: set the pattern. ``cycle``: ms per change of colour; FOOTFALLS: 0 for light legs on the floor."""
        await self.do(Code.SET_SKIN, {"mode": int(mode), "wave_cycle_time": cycle})
