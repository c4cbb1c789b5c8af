"""cyberdog.follow: walking after somebody whom the robot knows by face (4.4.03). Knows no way around obstacles."""

from __future__ import annotations

import asyncio
import math

from roboglot.model.actions import Action
from roboglot.model.components.driving import BASE, Driving
from roboglot.model.components.members import Members
from roboglot.model.components.vision import Vision
from roboglot.model.errors import InvalidGoal, NotFound, RobotError
from roboglot.model.geometry import Point, Twist
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

STRAIGHT_ON = "goes straight towards the person, around nothing, and stands still where it loses sight of them"
DISTANCE_MIN, DISTANCE_DEFAULT, DISTANCE_MAX = 0.5, 1.0, 5.0  # m
PERIOD = 0.1  # s
COMMAND = 0.4  # s that a velocity lasts: without a newer sight the robot brakes
SPEED_MAX, YAW_MAX = 0.8, 1.0  # m/s, rad/s
GIVE_UP_AFTER = 30.0  # s without a sight


class Following:
    """Whom the program may follow, and whom it does."""

    def __init__(self, session: Session) -> None:
        self.people: set[str] = set()
        self._session = session
        self._task: asyncio.Task[None] | None = None
        self._drive: Action | None = None
        self.name = ""

    def start(self, name: str, distance: float) -> None:
        """Follow this one and no other. Raises ComponentMissing."""
        robot = self._session.robot
        vision, driving = robot[Vision], robot[Driving]
        self.stop()
        self.name = name
        self._task = asyncio.create_task(self._follow(vision, driving, name, distance), name=f"follow {name}")

    def stop(self) -> None:
        """Follow nobody; the robot brakes."""
        if self._task:
            self._task.cancel()
        if self._drive:
            self._drive.cancel("following is over")
        self._task, self._drive, self.name = None, None, ""

    def close(self) -> None:
        """Follow nobody."""
        self.stop()

    async def _follow(self, vision: Vision, driving: Driving, name: str, distance: float) -> None:
        robot, who = self._session.robot, -1
        clock = robot.clock
        seen_at = clock.time()
        why = f"{name} is out of sight"
        with vision.faces.subscribe() as faces, vision.people.subscribe() as people:
            while clock.time() - seen_at < GIVE_UP_AFTER:
                await self._session.sleep(PERIOD)
                who = next((face.number for look in faces.drain() for face in look.seen if face.name == name), who)
                places = [person.place for look in people.drain() for person in look.seen if person.number == who]
                if any(action.source != self._session.source for action in robot.actions.running(BASE)):
                    why = "somebody else moves the robot"
                    break
                if places:
                    seen_at = clock.time()
                    command = towards(places[-1], distance)
                    self._drive = driving.drive(command, lifetime=COMMAND, source=self._session.source)
        self._session.states["follow"] = state(StateCode.FAIL, why)
        self._task, self.name = None, ""


def towards(place: Point, distance: float) -> Twist:
    """The velocity that brings a person at ``place`` (base_link) to ``distance`` m ahead."""
    too_far = math.hypot(place.x, place.y) - distance
    bearing = math.atan2(place.y, place.x)
    speed = max(0.0, min(SPEED_MAX, too_far)) * max(0.0, math.cos(bearing))
    return Twist(speed if too_far > 0.05 else 0.0, 0.0, max(-YAW_MAX, min(YAW_MAX, 1.5 * bearing)))


@ABILITIES.on("cyberdog.follow.add_personnel")
async def add_personnel(session: Session, preset_name: str = "") -> Record:
    """Let the program follow this member, whose face the robot knows."""
    try:
        if session.robot[Members].get(preset_name).face is None:
            raise NotFound(f"the robot does not know the face of {preset_name!r}")
    except RobotError as error:
        return state(StateCode.FAIL, str(error))
    session.part(Following).people.add(preset_name)
    return state()


@ABILITIES.on("cyberdog.follow.delete_personnel")
async def delete_personnel(session: Session, preset_name: str = "") -> Record:
    """Take that back; who is being followed is followed no more."""
    following = session.part(Following)
    if preset_name not in following.people:
        return state(StateCode.FAIL, f"{preset_name!r} was not added")
    following.people.discard(preset_name)
    if following.name == preset_name:
        following.stop()
    return state()


@ABILITIES.on("cyberdog.follow.follow_personnel", partial=STRAIGHT_ON)
async def follow_personnel(session: Session, preset_name: str = "", intimacy: float = 0.0) -> Record:
    """Walk after somebody who was added, ``intimacy`` m behind (0.5 to 5; 0: 1 m), while the program goes on.

    Lasts until it is cancelled, somebody else moves the robot, the person was out of sight for 30 s, or the program
    ends; ``cyberdog.follow.state`` says why.
    """
    following = session.part(Following)
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
    """Follow this one (no name: whoever it is) no more."""
    following = session.part(Following)
    if not following.name or preset_name not in ("", following.name):
        return state(StateCode.FAIL, f"{preset_name or 'nobody'} is not being followed")
    following.stop()
    return state()
