"""The PWM chapter (manual 3.2.8)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class Pwm(Chapter):
    """``client.pwm``. Bit n-1 of ``port_mask`` is output n."""

    async def value(self, port_mask: int, value: float) -> None:
        """Set the duty, percent (3.2.8.1)."""
        await self._do("pwm value", hex(port_mask), value)

    async def freq(self, port_mask: int, value: int) -> None:
        """Set the frequency, Hz (3.2.8.2)."""
        await self._do("pwm freq", hex(port_mask), value)
