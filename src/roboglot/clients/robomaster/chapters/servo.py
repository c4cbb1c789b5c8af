"""The servo chapter (manual 3.2.12). Degrees, degrees/s."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class Servo(Chapter):
    """``client.servo``: 1 to 3."""

    async def angle(self, id: int, angle: float, *, wait: bool = False) -> None:
        """Turn a servo to an angle, degrees (3.2.12.1)."""
        await self._do("servo angle", id=id, angle=angle, wait=wait or None)

    async def speed(self, id: int, speed: float) -> None:
        """Keep turning a servo, degrees/s (3.2.12.2)."""
        await self._do("servo speed", id=id, speed=speed)

    async def stop(self, id: int | None = None) -> None:
        """Stop all servos, or one (3.2.12.3)."""
        await self._do("servo stop", id=id)

    async def recenter(self, id: int, *, wait: bool = False) -> None:
        """Turn a servo to 0; in no manual."""
        await self._do("servo recenter", id=id, wait=wait or None)

    async def get_angle(self, id: int) -> float:
        """Return the angle of a servo, degrees (3.2.12.4)."""
        return await self._number("servo angle", id=id)
