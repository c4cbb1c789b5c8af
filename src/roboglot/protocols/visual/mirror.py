"""Exchange with the cloud (0.2.1.3): uploads operations of front ends, downloads favourites that the robot lacks.

Knows frames and the cloud's link; while the cloud is unreachable, frames wait in the outbox and delay nothing.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable, Sequence

from roboglot.model.clock import Clock
from roboglot.protocols.door import CloudLink, Outbox
from roboglot.wire.visual.cloud import CloudCode, inquiry, save_frame
from roboglot.wire.visual.requests import BadFrame, Request, parse_request

log = logging.getLogger(__name__)

RETRY_FIRST, RETRY_MAX = 1.0, 60.0  # s
PASSES_MAX = 10  # attempts to save programs that depend on each other
AGAIN = frozenset({CloudCode.TIMED_OUT, CloudCode.BROKEN, CloudCode.UNAUTHORISED, CloudCode.REFUSED})
"""Codes after which a frame is sent again; after any other code the cloud would never accept it."""


Save = Callable[[Request], Awaitable[bool]]


class CloudMirror:
    """Mirror of one robot. ``start`` begins sending, ``close`` ends it; unsent frames are sent after the next start."""

    def __init__(self, link: CloudLink, outbox: Outbox, clock: Clock, failures: type[Exception]) -> None:
        self._link = link
        self._outbox = outbox
        self._clock = clock
        self._failures = failures
        self._wake = asyncio.Event()
        self._sender: asyncio.Task[None] | None = None
        self._away_until = -1.0

    def start(self) -> None:
        """Send the waiting frames, and all later ones."""
        self._sender = asyncio.create_task(self._drain(), name="cloud")

    async def close(self) -> None:
        """Stop sending."""
        if self._sender is not None:
            self._sender.cancel()
            await asyncio.gather(self._sender, return_exceptions=True)

    async def note(self, request: Request) -> None:
        """Send the frame of a front end's completed operation to the cloud, with a time stamp as its id."""
        fields = {
            "type": request.kind,
            "id": self._stamp(),
            "operate": request.operate,
            "target_id": request.targets,
            "describe": request.describe,
            "style": request.style,
            "mode": request.mode,
            "condition": request.condition,
            "body": request.body,
        }
        await self.send(json.dumps(fields, ensure_ascii=False))

    async def send(self, frame: str) -> None:
        """Queue a frame for the cloud, such as the end of a task."""
        await self._outbox.put(frame)
        self._wake.set()

    async def fetch(self, kind: str, known: Sequence[str], save: Save) -> None:
        """Save the account's favourites that the robot lacks. Never overwrites or runs a program.

        ``save`` returns True if it was done. Failures are only logged, so that the robot's own list can be sent.
        """
        if self._clock.time() < self._away_until:
            return
        try:
            answer = await self._link.post(inquiry(kind, self._stamp(), known))
        except self._failures as error:
            log.warning("cannot fetch favourites: %s", error)
            self._away_until = self._clock.time() + RETRY_MAX
            return
        if answer.code is not CloudCode.OK:
            log.warning("cannot fetch favourites: the cloud answers %s %s", answer.code, answer.message)
            return
        waiting = []
        for item in answer.items:
            try:
                request = parse_request(save_frame(item, kind))
            except BadFrame as bad:
                log.warning("cannot read a favourite: %s", bad)
                continue
            if item.get("type") == kind and request.targets[0] not in known:
                waiting.append(request)
        for _ in range(PASSES_MAX):  # a module may follow the programs that call it
            before = len(waiting)
            waiting = [request for request in waiting if not await save(request)]
            if not waiting or len(waiting) == before:
                return

    async def _drain(self) -> None:
        pause = RETRY_FIRST
        while True:
            self._wake.clear()
            waiting = await self._outbox.first()
            if waiting is None:
                await self._wake.wait()
                continue
            number, frame = waiting
            if await self._taken(frame):
                await self._outbox.remove(number)
                pause = RETRY_FIRST
            else:
                await self._clock.sleep(pause)
                pause = min(2 * pause, RETRY_MAX)

    async def _taken(self, frame: str) -> bool:
        """Send a frame; return True if it can leave the outbox."""
        try:
            answer = await self._link.post(frame)
        except self._failures as error:
            log.warning("cannot reach the cloud yet: %s", error)
            return False
        if answer.code in AGAIN:
            log.warning("cannot send to the cloud yet: it answers %s %s", answer.code, answer.message)
            return False
        if answer.code is not CloudCode.OK:
            log.warning("the cloud rejects a frame: %s %s", answer.code, answer.message)
        return True

    def _stamp(self) -> str:
        return str(int(self._clock.epoch() * 1e6))
