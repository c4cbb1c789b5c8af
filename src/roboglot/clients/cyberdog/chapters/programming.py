"""Visual programming by 2002 and 2001: frames to the robot, feedback from it. Independent of programs' contents."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, NoAnswer
from roboglot.clients.cyberdog.values import ProgramFrame
from roboglot.clients.errors import TimedOut
from roboglot.model.feed import Feed, Viewer
from roboglot.wire.cyberdog.codes import Code

FEEDBACK_MAX = 60.0  # s


class Programs(Calls):
    """Frames, matched with their feedback by id."""

    frames: Feed[object]  # pushes of code 2001
    _numbers = itertools.count(1)

    async def send_frame(self, frame: Mapping[str, object]) -> None:
        """2002: send a frame unchanged; robots answer only by pushes (2001)."""
        try:
            await self.text(Code.PROGRAM_TO_ROBOT, frame)
        except NoAnswer:
            return

    async def operate(self, kind: str, operate: str, *targets: str, **fields: object) -> ProgramFrame:
        """Send a frame and wait for its feedback. Raises CyberDogRefused with the feedback's state, TimedOut."""
        id = f"roboglot-{next(self._numbers)}"
        frame = {"type": kind, "id": id, "operate": operate, "target_id": list(targets), **fields}
        with self.frames.subscribe() as frames:
            await self.send_frame(frame)
            try:
                reply = await self.clock.wait_for(_with_id(frames, id), FEEDBACK_MAX)
            except TimeoutError:
                raise TimedOut(f"{operate}: no feedback within {FEEDBACK_MAX:g} s") from None
        if state := reply.feedback.get("state", 0):
            raise CyberDogRefused(f"{kind} {operate}", int(state), str(reply.feedback.get("describe", "")))
        return reply

    async def deploy(self, task: str, body: str, *, describe: str = "", style: str = "") -> None:
        """Save ``body`` as the task ``task`` of mode single, to be run on command."""
        more = {"mode": "single", "condition": "now", "describe": describe, "style": style, "body": body}
        await self.operate("task", "save", task, **more)

    async def run_program(self, task: str) -> None:
        """Run a deployed task; its progress is pushed (ProgramFrame)."""
        await self.operate("task", "run", task)


async def _with_id(frames: Viewer[object], id: str) -> ProgramFrame:
    async for frame in frames:
        if isinstance(frame, ProgramFrame) and frame.feedback.get("id") == id:
            return frame
    raise TimedOut("the client was closed")
