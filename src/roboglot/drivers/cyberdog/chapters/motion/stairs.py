"""Alignment with stairs by the dog's own skill (1100, 1101), which reports its start but not its end."""

from __future__ import annotations

from roboglot.clients.errors import ClientError
from roboglot.drivers.cyberdog.chapters.mapping.tasks import Skills
from roboglot.drivers.cyberdog.vocabulary import WALKS, robot_errors
from roboglot.model.actions import Action
from roboglot.model.components.motion.stair_alignment import (
    ALIGN_WITH_STAIRS,
    AlignmentStage,
    StairAlignment,
    StairDirection,
)
from roboglot.model.errors import Expired, NotFound, Unconnected

LOOK = 0.1  # s between two looks at the heartbeat
SETTLED = 2.0  # s of standing after which it is done: heartbeats come every half second
ALIGN_MAX = 45.0  # s
_WALKING = frozenset(WALKS.values())


class CyberDogStairAlignment(StairAlignment):
    """Succeeds when the dog stops walking; it does not report whether it stands square."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    def align(self, direction: StairDirection, *, source: str = "") -> Action:
        skills = self._skills

        async def run(action: Action) -> None:
            action.report(AlignmentStage.LOOKING)
            with robot_errors():
                began = await skills.client.align_with_stairs(up=direction is StairDirection.UP)
            if not began:
                raise NotFound(f"the dog sees no step {direction} ahead, or may not walk")
            action.report(AlignmentStage.ALIGNING)
            try:
                await self._until_it_stands()
            except BaseException:
                await self._call_off()
                raise

        return skills.start_moving(ALIGN_WITH_STAIRS, run, direction, source)

    async def _until_it_stands(self) -> None:
        clock = self._skills.robot.clock
        begun = walked = clock.time()
        while clock.time() - walked < SETTLED:
            self._skills.link.require()
            if clock.time() - begun > ALIGN_MAX:
                raise Expired(f"the dog still walks after {ALIGN_MAX:g} s")
            beat = self._skills.client.heartbeat
            if beat is None or beat.motion_id in _WALKING:
                walked = clock.time()
            await clock.sleep(LOOK)

    async def _call_off(self) -> None:
        try:
            self._skills.link.require()
            await self._skills.client.end_stair_alignment()
        except (ClientError, Unconnected):
            return  # the dog stops by itself without its app
