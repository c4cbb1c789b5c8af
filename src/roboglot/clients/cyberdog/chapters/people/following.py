"""Chapter "following": 6004 types 11 and 13, 6008."""

from __future__ import annotations

from roboglot.clients.cyberdog.chapters.mapping.tasks import OnFeedback, Tasks
from roboglot.clients.cyberdog.running import RunningTask
from roboglot.clients.cyberdog.values import Region
from roboglot.wire.cyberdog.codes import Code, TaskType

CHOICE_MAX = 35.0  # s: the robot itself gives up after 30
AUTO, BEHIND, LEFT, RIGHT = 200, 201, 202, 203  # side of the person on which the robot walks


class Following(Tasks):
    """Following a person, an object or the bracelet."""

    async def follow(
        self,
        *,
        bracelet: bool = False,
        thing: bool = False,
        side: int = AUTO,
        distance: float = 1.0,
        on_feedback: OnFeedback | None = None,
    ) -> RunningTask:
        """Follow a person in the picture, any object with ``thing`` (then ``choose_target``), or the bracelet."""
        kind = TaskType.UWB_FOLLOWING if bracelet else TaskType.VISION_FOLLOWING
        params = {"relative_pos": side, "keep_distance": float(distance), "object_tracking": thing}
        return await self.begin(kind, params, on_feedback)

    async def choose_target(self, region: Region) -> None:
        """6008: choose the person or object in a part of the picture."""
        await self.do(Code.CHOOSE_TARGET, {"roi": region}, within=CHOICE_MAX)
