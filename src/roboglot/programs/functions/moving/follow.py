"""cyberdog.follow: following a person known by face (4.4.03), around obstacles."""

from __future__ import annotations

import asyncio

from roboglot.model.actions import Action
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.following import DISTANCE_MAX, DISTANCE_MIN, Following
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import Busy, InvalidGoal, NotFound, RobotError
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

DISTANCE_DEFAULT = 1.0  # m
PERIOD = 0.1  # s
GIVE_UP_AFTER = 30.0  # s without seeing a person
SKILL_SEARCHES = 15.0  # part of GIVE_UP_AFTER in which the skill itself searches, s


class FollowedMember:
    """The followed person, one of those added. Faces identify people; the robot's skill follows them."""

    def __init__(self, session: Session) -> None:
        self.people: set[str] = set()
        self._session = session
        self._task: asyncio.Task[None] | None = None
        self._walk: Action | None = None
        self.name = ""

    def start(self, name: str, distance: float) -> None:
        """Follow this person, in place of any other. Raises ComponentMissing."""
        robot = self._session.robot
        vision, skill = robot[Vision], robot[Following]
        self.stop()
        self.name = name
        self._task = asyncio.create_task(self._follow(vision, skill, name, distance), name=f"follow {name}")

    def stop(self) -> None:
        """Stop following; the robot brakes."""
        if self._task:
            self._task.cancel()
        if self._walk:
            self._walk.cancel("following is over")
        self._task, self._walk, self.name = None, None, ""

    def close(self) -> None:
        """Stop following."""
        self.stop()

    async def _follow(self, vision: Vision, skill: Following, name: str, distance: float) -> None:
        """Look for the face, follow its person until they are lost, and look for the face again."""
        clock, left, who, why = self._session.robot.clock, GIVE_UP_AFTER, None, ""
        with vision.faces.subscribe() as faces:
            while left > 0 and not why:
                began = clock.time()
                await self._session.sleep(PERIOD)
                seen = next((face.number for look in faces.drain() for face in look.seen if face.name == name), None)
                if seen is None and who is None:
                    left -= clock.time() - began
                elif (seen is not None and seen != who) or self._walk is None:
                    who = who if seen is None else seen
                    self._walk = skill.follow(who, distance=distance, source=self._session.source)
                elif self._walk.status.ended:
                    why, lost = await self._ended(self._walk)
                    left, self._walk = GIVE_UP_AFTER, None
                    if lost:
                        left, who = GIVE_UP_AFTER - SKILL_SEARCHES, None
        self._session.states["follow"] = state(StateCode.FAIL, why or f"{name} is out of sight")
        self._task, self.name = None, ""

    async def _ended(self, walk: Action) -> tuple[str, bool]:
        """Return why following is over (empty: it continues), and whether the person was lost."""
        match walk.error:
            case NotFound():
                return "", True
            case RobotError() as error if not isinstance(error, Busy):
                return str(error), False
        others = self._session.robot.actions.running(BASE)
        if not others or any(action.source != self._session.source for action in others):
            return "another client moves the robot", False
        for action in others:  # the program's own drives take precedence
            await action.done()
        return "", False


@ABILITIES.on("cyberdog.follow.add_personnel", needs=(Members,))
async def add_personnel(session: Session, preset_name: str = "") -> Record:
    """Let the program follow this member, whose face the robot knows."""
    try:
        if session.robot[Members].get(preset_name).face is None:
            raise NotFound(f"the robot does not know the face of {preset_name!r}")
    except RobotError as error:
        return state(StateCode.FAIL, str(error))
    session.part(FollowedMember).people.add(preset_name)
    return state()


@ABILITIES.on("cyberdog.follow.delete_personnel")
async def delete_personnel(session: Session, preset_name: str = "") -> Record:
    """Remove a person who was added, and stop following them."""
    following = session.part(FollowedMember)
    if preset_name not in following.people:
        return state(StateCode.FAIL, f"{preset_name!r} was not added")
    following.people.discard(preset_name)
    if following.name == preset_name:
        following.stop()
    return state()


@ABILITIES.on("cyberdog.follow.follow_personnel", needs=(Following, Vision))
async def follow_personnel(session: Session, preset_name: str = "", intimacy: float = 0.0) -> Record:
    """Follow a person who was added, ``intimacy`` m behind (0.5 to 5; 0: 1 m), while the program continues.

    Walks around obstacles, or along the person's way; the program's own motions take precedence.

    Ends when it is cancelled, another client moves the robot, the person is out of sight for 30 s, or the program ends;
    ``cyberdog.follow.state`` has the reason.
    """
    following = session.part(FollowedMember)
    distance = intimacy or DISTANCE_DEFAULT
    try:
        if preset_name not in following.people:
            raise NotFound(f"{preset_name!r} was not added")
        if not DISTANCE_MIN <= distance <= DISTANCE_MAX:
            raise InvalidGoal(f"intimacy = {intimacy:g} is outside of {DISTANCE_MIN} to {DISTANCE_MAX} m")
        following.start(preset_name, distance)
    except RobotError as error:
        return state(StateCode.FAIL, str(error))
    return state()


@ABILITIES.on("cyberdog.follow.cancel_follow")
async def cancel_follow(session: Session, preset_name: str = "") -> Record:
    """Stop following this person; without a name, anyone."""
    following = session.part(FollowedMember)
    if not following.name or preset_name not in ("", following.name):
        return state(StateCode.FAIL, f"the robot does not follow {preset_name or 'a person'}")
    following.stop()
    return state()
