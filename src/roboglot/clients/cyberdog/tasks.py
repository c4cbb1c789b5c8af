"""Chapters "tasks", "navigation", "mapping", "following", "labels": 6002 to 6010."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused
from roboglot.clients.cyberdog.running import RunningTask
from roboglot.clients.cyberdog.values import Label, LabelledMap, Region
from roboglot.wire.cyberdog.codes import Code, TaskType

CHOICE_MAX = 35.0  # s: the robot itself gives up after 30
AUTO, BEHIND, LEFT, RIGHT = 200, 201, 202, 203  # where to keep by whom one follows
OnFeedback = Callable[[int], object]


class Tasks(Calls):
    """Long work of the robot. ``on_feedback`` is called with every feedback code."""

    async def begin(
        self, kind: TaskType, params: dict[str, Any] | None = None, on_feedback: OnFeedback | None = None
    ) -> RunningTask:
        """6004: start it. Raises CyberDogRefused when the robot is at something else."""
        task = RunningTask(self, kind, on_feedback)
        await task.begin(Code.START_TASK, {"type": int(kind), **(params or {})})
        return task

    async def join(self, kind: TaskType, on_feedback: OnFeedback | None = None) -> RunningTask:
        """6010: the one under way, from its latest feedback on."""
        task = RunningTask(self, kind, on_feedback)
        await task.begin(Code.JOIN_TASK, {"type": int(kind)})
        return task

    async def stop_task(self, kind: TaskType = TaskType.ALL) -> None:
        """6009: ALL leaves navigation and localisation."""
        await self.do(Code.STOP_TASK, {"type": int(kind)}, within=65.0)

    async def map_surroundings(self, *, outdoor: bool = False, on_feedback: OnFeedback | None = None) -> RunningTask:
        """Begin a map; drive about, then ``save_map``."""
        return await self.begin(TaskType.MAPPING, {"outdoor": outdoor}, on_feedback)

    async def save_map(self, name: str) -> None:
        """6009: end mapping; an empty name throws the map away."""
        await self.do(Code.STOP_TASK, {"type": int(TaskType.MAPPING), "map_name": name}, within=65.0)

    async def relocalise(self, *, outdoor: bool = False, on_feedback: OnFeedback | None = None) -> RunningTask:
        """Find the robot in its map; needed before ``navigate``."""
        return await self.begin(TaskType.LOCALIZATION, {"outdoor": outdoor}, on_feedback)

    async def navigate(
        self,
        x: float,
        y: float,
        theta: float | None = None,
        *,
        outdoor: bool = False,
        on_feedback: OnFeedback | None = None,
    ) -> RunningTask:
        """Go to a point of the map (m), facing ``theta`` (rad) there; ``outdoor``: as it was localized."""
        goal: dict[str, Any] = {"goalX": float(x), "goalY": float(y), "outdoor": outdoor}
        if theta is not None:
            goal["theta"] = float(theta)
        return await self.begin(TaskType.NAVIGATION, goal, on_feedback)

    async def charge(self, *, on_feedback: OnFeedback | None = None) -> RunningTask:
        """Go to the dock."""
        return await self.begin(TaskType.DOCKING, None, on_feedback)

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
        """6008: who or what is in that part of the picture."""
        await self.do(Code.CHOOSE_TARGET, {"roi": region}, within=CHOICE_MAX)

    async def get_map(self, name: str = "") -> LabelledMap:
        """6003. Raises CyberDogRefused when there is none."""
        found = await self.ask(Code.GET_LABELS, LabelledMap, {"mapName": name}, within=15.0)
        if found.success:
            raise CyberDogRefused(Code.GET_LABELS.name, found.success, "there is no map")
        return found

    async def set_labels(self, map_name: str, labels: Sequence[Label]) -> None:
        """6002: instead of those that are there."""
        await self.do(Code.SET_LABELS, {"mapName": map_name, "is_outdoor": False, "locationLabelInfo": labels})

    async def delete_labels(self, map_name: str, names: Sequence[str]) -> None:
        """6002; without names nothing is done, for that would delete the map."""
        if names:
            labels = [Label(name, 0.0, 0.0) for name in names]
            await self.do(Code.SET_LABELS, {"mapName": map_name, "locationLabelInfo": labels, "only_delete": True})

    async def delete_map(self, name: str) -> None:
        """6002: with its labels."""
        await self.do(Code.SET_LABELS, {"mapName": name, "only_delete": True})
