"""The camera, stream and audio chapters (manual 3.2.16 to 3.2.18)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class Camera(Chapter):
    """``client.camera``."""

    async def exposure(self, ev_level: str) -> None:
        """Set the exposure: default, small, medium, large (3.2.16.1)."""
        await self._do("camera exposure", ev_level)


class Stream(Chapter):
    """``client.stream``; ``client.video()`` has the pictures."""

    async def on(self) -> None:
        """Start the video stream (3.2.17.1)."""
        await self._do("stream on")

    async def off(self) -> None:
        """Stop the video stream (3.2.17.2)."""
        await self._do("stream off")


class Audio(Chapter):
    """``client.audio``; ``client.sounds()`` has the packets."""

    async def on(self) -> None:
        """Start the audio stream (3.2.18.1)."""
        await self._do("audio on")

    async def off(self) -> None:
        """Stop the audio stream (3.2.18.2)."""
        await self._do("audio off")
