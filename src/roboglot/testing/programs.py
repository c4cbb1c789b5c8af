"""A client of block programs for tests: saves a program, runs it and returns the blocks it went through."""

from __future__ import annotations

import json
from dataclasses import field

from roboglot.clients.errors import LinkLost
from roboglot.clients.visual import TextLink
from roboglot.model.clock import RealClock
from roboglot.values import dataclass

SECONDS_MAX = 60.0
SAVING = {"mode": "single", "condition": "now", "style": "", "describe": ""}


class ProgramFailed(AssertionError):
    """The robot refused the program, or it ended with an error; the message is the robot's."""


@dataclass(frozen=True, slots=True)
class ProgramRun:
    """Blocks in the order in which they began, and the printed lines."""

    blocks: list[str] = field(default_factory=list)
    printed: list[str] = field(default_factory=list)


class ProgramClient:
    """``async with ProgramClient("127.0.0.1") as programs: await programs.run(source)``."""

    def __init__(self, host: str, port: int = 50053) -> None:
        self._url = f"ws://{host}:{port}"
        self._frames: TextLink | None = None
        self._log: TextLink | None = None

    async def __aenter__(self) -> ProgramClient:
        self._frames, self._log = await TextLink.open(self._url, "/programs"), await TextLink.open(self._url, "/log")
        return self

    async def __aexit__(self, *_: object) -> None:
        for link in (self._frames, self._log):
            if link is not None:
                await link.close()

    async def run(self, source: str, *, task: str = "test", within: float = SECONDS_MAX) -> ProgramRun:
        """Save a program and run it to its end. ``within``: real s. Raises ProgramFailed, TimeoutError, LinkLost."""
        return await RealClock().wait_for(self._run(source, task), within)

    async def _run(self, source: str, task: str) -> ProgramRun:
        await self.ask("save", task, body=source, **SAVING)
        await self.ask("run", task)
        blocks = await self._follow(task)
        return ProgramRun(blocks, await self._printed(task))

    async def ask(self, operate: str, *targets: str, **fields: str) -> dict[str, object]:
        """Send one frame and return the answer's ``feedback`` or ``response``. Raises ProgramFailed, LinkLost."""
        id = f"test-{operate}"
        await self._of(self._frames).send(
            json.dumps({"type": "task", "id": id, "operate": operate, "target_id": targets} | fields)
        )
        async for text in self._of(self._frames):
            frame = json.loads(text)
            content: dict[str, object] = frame.get("feedback") or frame["response"]
            if content["id"] == id:
                if content.get("state"):
                    raise ProgramFailed(f"{operate}: {content['describe']} ({content['state']})")
                return content
        raise LinkLost("the robot went away")

    async def _follow(self, task: str) -> list[str]:
        blocks: list[str] = []
        async for text in self._of(self._frames):
            frame = json.loads(text)
            feedback = frame.get("feedback", {})
            if feedback.get("target_id") != task:
                continue
            block = frame.get("block")
            if block and block["type"] == "begin":
                blocks.append(block["id"])
            elif not block and feedback.get("state"):
                raise ProgramFailed(str(feedback["describe"]))
            elif not block and feedback["operate"] == "stop":
                return blocks
        raise LinkLost("the robot went away")

    async def _printed(self, task: str) -> list[str]:
        """Return the lines printed since the program was run."""
        log, lines = self._of(self._log), list[str]()
        await log.send("")  # its answer follows everything printed before
        async for text in log:
            line = json.loads(text)
            if "entries" in line:
                return lines
            if line["target_id"] == task and line["level"] == "print":
                lines.append(line["text"])
        raise LinkLost("the robot went away")

    @staticmethod
    def _of(link: TextLink | None) -> TextLink:
        if link is None:
            raise LinkLost("not connected: use `async with`")
        return link
