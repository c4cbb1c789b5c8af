"""The AI, camera, stream, audio and game chapters (manual 3.2.15 to 3.2.18, 3.2.20)."""

from __future__ import annotations

from roboglot.clients.robomaster.chapter import Chapter, on_off


class Ai(Chapter):
    """``client.ai``: what is made out in the picture comes as TargetsSeen and LinesSeen."""

    async def attribute(
        self, *, line_color: str | None = None, marker_color: str | None = None, marker_dist: float | None = None
    ) -> None:
        """Which lines and markers count; colours red, green, blue, m (3.2.15.1)."""
        await self._do("AI attribute", line_color=line_color, marker_color=marker_color, marker_dist=marker_dist)

    async def push(
        self,
        *,
        person: bool | None = None,
        gesture: bool | None = None,
        marker: bool | None = None,
        robot: bool | None = None,
        line: bool | None = None,
        people: bool | None = None,
        pose: bool | None = None,
    ) -> None:
        """Switch kinds on or off: one of the first four, and line beside it (3.2.15.2).

        Real robots say people and pose for person and gesture.
        """
        await self._do(
            "AI push",
            person=on_off(person), gesture=on_off(gesture), marker=on_off(marker), robot=on_off(robot),
            line=on_off(line), people=on_off(people), pose=on_off(pose),
        )  # fmt: skip


class Camera(Chapter):
    """``client.camera``."""

    async def exposure(self, ev_level: str) -> None:
        """default, small, medium, large (3.2.16.1)."""
        await self._do("camera exposure", ev_level)


class Stream(Chapter):
    """``client.stream``; ``client.video()`` has the pictures."""

    async def on(self) -> None:
        """3.2.17.1."""
        await self._do("stream on")

    async def off(self) -> None:
        """3.2.17.2."""
        await self._do("stream off")


class Audio(Chapter):
    """``client.audio``; ``client.sounds()`` has the packets."""

    async def on(self) -> None:
        """3.2.18.1."""
        await self._do("audio on")

    async def off(self) -> None:
        """3.2.18.2."""
        await self._do("audio off")


class GameMessages(Chapter):
    """``client.game_msg``: the pilot's keyboard and mouse come as GameInput."""

    async def on(self) -> None:
        """3.2.20.1."""
        await self._do("game_msg on")

    async def off(self) -> None:
        """3.2.20.2."""
        await self._do("game_msg off")
