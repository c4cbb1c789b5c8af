"""Following by the dog's own skills: a person in its picture (6004 type 13) or its bracelet (type 11)."""

from __future__ import annotations

from roboglot.clients.cyberdog import RunningTask, values
from roboglot.drivers.cyberdog.chapters.mapping.tasks import Skills
from roboglot.model.actions import Action
from roboglot.model.components.motion.following import Following, FollowSide, check_distance
from roboglot.model.errors import NotFound, Refused
from roboglot.model.feed import Viewer
from roboglot.model.geometry import Point

SIDES = {FollowSide.BEHIND: 201, FollowSide.LEFT: 202, FollowSide.RIGHT: 203}
SEEN_WITHIN = 10.0  # s for the person to appear in the picture


class CyberDogFollowing(Following):
    """People are numbered as the dog numbers them; the nearest is the one whose box is largest."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    def follow(
        self,
        person: int | None = None,
        *,
        side: FollowSide = FollowSide.BEHIND,
        distance: float = 1.0,
        source: str = "",
    ) -> Action:
        check_distance(distance)
        skills = self._skills

        async def choose(_: RunningTask) -> None:
            clock, client = skills.robot.clock, skills.client
            with client.watch(values.Tracking) as pushes:
                try:
                    region = await clock.wait_for(_in_sight(pushes, person), SEEN_WITHIN)
                except TimeoutError:
                    raise NotFound("no person to follow is in sight") from None
            await client.choose_target(region)

        return skills.start_from_idle(
            "follow",
            lambda: skills.client.follow(side=SIDES[side], distance=distance),
            goal=person,
            source=source,
            then=choose,
        )

    def follow_tag(self, *, side: FollowSide = FollowSide.BEHIND, distance: float = 1.0, source: str = "") -> Action:
        check_distance(distance)
        client = self._skills.client
        return self._skills.start_from_idle(
            "follow the bracelet",
            lambda: client.follow(bracelet=True, side=SIDES[side], distance=distance),
            goal=None,
            source=source,
        )

    def follow_thing(
        self, place: Point, *, side: FollowSide = FollowSide.BEHIND, distance: float = 1.0, source: str = ""
    ) -> Action:
        raise Refused("a dog's app protocol takes regions of its picture, not places")

    @property
    def place(self) -> Point | None:
        return None


async def _in_sight(pushes: Viewer[values.Tracking], person: int | None) -> values.Region:
    async for push in pushes:
        seen = [body.roi for body in push.body_info_roi if person is None or body.reid == str(person)]
        if seen:
            return max(seen, key=lambda roi: roi.width * roi.height)
    raise NotFound("the robot sends no more detections")
