"""The AI chapter (manual 3.2.15)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter, on_off


class Ai(Chapter):
    """``client.ai``: recognition in the picture, received as TargetsSeen and LinesSeen."""

    async def attribute(
        self, *, line_color: str | None = None, marker_color: str | None = None, marker_dist: float | None = None
    ) -> None:
        """Filter lines and markers: colours red, green, blue; distance in m (3.2.15.1)."""
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
