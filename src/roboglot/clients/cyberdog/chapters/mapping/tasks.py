"""Chapters "tasks", "mapping", "navigation" and "charging": 6004, 6009, 6010."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from roboglot.clients.cyberdog.calls import Calls
from roboglot.clients.cyberdog.running import RunningTask
from roboglot.wire.cyberdog.codes import Code, TaskType

OnFeedback = Callable[[int], object]


class Tasks(Calls):
    """Long tasks of the robot. ``on_feedback`` is called with every feedback code."""

    async def begin(
        self, kind: TaskType, params: Mapping[str, object] | None = None, on_feedback: OnFeedback | None = None
    ) -> RunningTask:
        """6004: start a task. Raises CyberDogRefused if the robot is busy with another one."""
        task = RunningTask(self, kind, on_feedback)
        await task.begin(Code.START_TASK, {"type": int(kind), **(params or {})})
        return task

    async def join(self, kind: TaskType, on_feedback: OnFeedback | None = None) -> RunningTask:
        """6010: join a running task, from its latest feedback on. Raises CyberDogRefused."""
        task = RunningTask(self, kind, on_feedback)
        await task.begin(Code.JOIN_TASK, {"type": int(kind)})
        return task

    async def stop_task(self, kind: TaskType = TaskType.ALL) -> None:
        """6009: stop a task; ALL ends navigation and localisation."""
        await self.do(Code.STOP_TASK, {"type": int(kind)}, within=65.0)

    async def map_surroundings(self, *, outdoor: bool = False, on_feedback: OnFeedback | None = None) -> RunningTask:
        """Start mapping; drive around, then call ``save_map``."""
        return await self.begin(TaskType.MAPPING, {"outdoor": outdoor}, on_feedback)

    async def save_map(self, name: str) -> None:
        """6009: end mapping; an empty name discards the map."""
        await self.do(Code.STOP_TASK, {"type": int(TaskType.MAPPING), "map_name": name}, within=65.0)

    async def relocalise(self, *, outdoor: bool = False, on_feedback: OnFeedback | None = None) -> RunningTask:
        """Localize the robot in its map; required before ``navigate``."""
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
        """Go to a point of the map (m), with the final heading ``theta`` (rad); ``outdoor``: as in ``relocalise``."""
        goal: dict[str, object] = {"goalX": float(x), "goalY": float(y), "outdoor": outdoor}
        if theta is not None:
            goal["theta"] = float(theta)
        return await self.begin(TaskType.NAVIGATION, goal, on_feedback)

    async def charge(self, *, on_feedback: OnFeedback | None = None) -> RunningTask:
        """Go to the dock and charge."""
        return await self.begin(TaskType.DOCKING, None, on_feedback)
