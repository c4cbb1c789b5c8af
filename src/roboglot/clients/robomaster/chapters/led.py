"""The LED chapter (manual 3.2.9)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class Led(Chapter):
    """``client.led``."""

    async def control(
        self,
        comp: str,
        effect: str,
        r: int = 255,
        g: int = 255,
        b: int = 255,
        *,
        blink_freq: int | None = None,
        single_led_index: int | None = None,
    ) -> None:
        """comp: all, top_all, bottom_left …; effect: solid, off, pulse, blink, scrolling (3.2.9.1)."""
        await self._do(
            "led control",
            comp=comp, r=r, g=g, b=b, effect=effect, blink_freq=blink_freq, single_led_index=single_led_index,
        )  # fmt: skip
