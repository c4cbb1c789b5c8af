"""The gimbal chapter (manual 3.2.4). Degrees, degrees/s; pitch up and yaw right are positive."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter, on_off
from roboglot.wire.robomaster.telemetry import GimbalAttitude


class Gimbal(Chapter):
    """``client.gimbal``. Robots answer nothing else while a motion is waited for; ``wait=False`` does not wait."""

    async def speed(self, p: float = 0.0, y: float = 0.0) -> None:
        """Turn at a speed until the next command (3.2.4.1)."""
        await self._do("gimbal speed", p=p, y=y)

    async def move(
        self,
        p: float | None = None,
        y: float | None = None,
        *,
        vp: float | None = None,
        vy: float | None = None,
        wait: bool = True,
    ) -> None:
        """Turn by p and y (3.2.4.2)."""
        await self._do("gimbal move", p=p, y=y, vp=vp, vy=vy, wait=wait)

    async def moveto(
        self,
        p: float | None = None,
        y: float | None = None,
        *,
        vp: float | None = None,
        vy: float | None = None,
        wait: bool = True,
    ) -> None:
        """Turn to p and y (3.2.4.3)."""
        await self._do("gimbal moveto", p=p, y=y, vp=vp, vy=vy, wait=wait)

    async def suspend(self) -> None:
        """Release the motors (3.2.4.4)."""
        await self._do("gimbal suspend")

    async def resume(self) -> None:
        """Power the motors again (3.2.4.5)."""
        await self._do("gimbal resume")

    async def recenter(self, *, wait: bool = True) -> None:
        """Turn to the chassis' front (3.2.4.6)."""
        await self._do("gimbal recenter", wait=wait)

    async def stop(self) -> None:
        """Stop and hold the angles; in no manual."""
        await self._do("gimbal stop")

    async def get_attitude(self) -> GimbalAttitude:
        """Return the attitude (3.2.4.7)."""
        return GimbalAttitude(*await self._numbers("gimbal attitude", 2))

    async def push(self, attitude: bool, afreq: int | None = None) -> None:
        """Switch GimbalAttitude on or off (3.2.4.8)."""
        await self._do("gimbal push", attitude=on_off(attitude), afreq=afreq)
