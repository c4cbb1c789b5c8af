"""A front end for tests: sends frames to the door, reads what comes back."""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from roboglot.model.clock import LockstepClock
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.server import VisualDoor

Frame = dict[str, Any]
PATIENCE = 60.0  # s of the machine's time for work of a worker process


class FrontEnd:
    """Stand-in for the app: ``ask`` sends one frame and returns its answer."""

    def __init__(self, door: VisualDoor, service: ProgramService, clock: LockstepClock) -> None:
        self.door = door
        self.service = service
        self.clock = clock
        self.frames: list[Frame] = []
        self._ids = itertools.count(1)
        door.subscribe(lambda text: self.frames.append(json.loads(text)))

    async def ask(self, operate: str, *targets: str, type: str = "task", **fields: Any) -> list[Frame]:
        """Return the answers to one frame, as the contents of feedback or response."""
        id = f"f{next(self._ids)}"
        await self.door.receive(
            json.dumps({"type": type, "id": id, "operate": operate, "target_id": list(targets)} | fields)
        )
        answers = [frame.get("feedback") or frame["response"] for frame in self.frames]
        return [answer for answer in answers if answer["id"] == id]

    async def save(self, id: str, body: str, **fields: Any) -> Frame:
        [answer] = await self.ask("save", id, **{"mode": "single", "condition": "now", "body": body} | fields)
        return answer

    async def start(self, id: str, body: str) -> None:
        """Save, run, and wait until it runs."""
        assert (await self.save(id, body))["state"] == 0
        [answer] = await self.ask("run", id)
        assert answer["state"] == 0, answer
        await self.until(lambda: self.news(id, "start"))

    def news(self, id: str, operate: str) -> list[Frame]:
        """Return the frames a task sent by itself."""
        return [
            frame
            for frame in self.frames
            if (feedback := frame.get("feedback", {})).get("target_id") == id
            and feedback["operate"] == operate
            and feedback["id"].startswith("task_")
        ]

    def blocks(self, id: str) -> list[tuple[str, str]]:
        return [(f["block"]["type"], f["block"]["id"]) for f in self.news(id, "run") if "block" in f]

    async def state(self, id: str) -> str:
        [answer] = await self.ask("inquiry", id)
        return "null" if not answer["list"] else str(answer["list"][0]["operate"])

    async def printed(self, id: str) -> list[str]:
        return [entry.text for entry in await self.service.log(id) if entry.level == "print"]

    async def until(self, condition: Callable[[], object], *, pace: float = 0.05) -> None:
        """Let robot time pass at ``pace`` seconds a look until ``condition`` holds."""
        async with asyncio.timeout(PATIENCE):
            while not condition():
                await asyncio.sleep(0.002)
                await self.clock.advance(pace)

    async def ends(self, id: str, **options: Any) -> None:
        await self.until(lambda: self.news(id, "stop"), **options)


def alive(pid: int) -> bool:
    """Return whether there is such a process."""
    return Path(f"/proc/{pid}").exists()
