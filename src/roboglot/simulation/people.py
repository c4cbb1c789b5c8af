"""People: they walk their paths, follow scripts, and stop when a robot is right in front of them. Knows no physics."""

from __future__ import annotations

import hashlib
import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property

from roboglot.model.geometry import Point, Pose
from roboglot.simulation import figure
from roboglot.simulation.description import Person
from roboglot.simulation.figure import Floats
from roboglot.simulation.routine import Clap, Exercise, Feel, Look, Say, Show, Step, Wait, Walk
from roboglot.simulation.voice import speaking_time

MANNERS = 0.8  # m to a robot ahead at which people wait
SIDE = 0.55  # m to the side at which they still pass it
TURN_RATE = 2.5  # rad/s
CLAP_PAUSE = 0.35  # s between claps
TOLD_MAX = 100  # steps that wait for somebody


class Walker:
    """One person: where they are, what they do and feel. ``key`` names them if the description does not."""

    def __init__(self, person: Person, floor: int, key: str = "") -> None:
        self.person, self.floor, self.key = person, floor, person.name or key
        self.emotion = person.emotion
        self.walking = False
        self.displaced = False  # whether they were put elsewhere since the last tick
        self._aloud: list[Say | Clap] = []
        self._script = person.script or tuple(_strolling(person))
        self._number = 0
        self._told: deque[Step] | None = None  # None: they follow their script
        self.doing: Step | None = None
        self._elapsed = 0.0
        self._way = 0.0
        path = [Point(*spot) for spot in person.path]
        facing = path[0].bearing_to(path[1]) if len(path) > 1 else 0.0
        if person.facing is not None:
            facing = math.radians(person.facing)
        self.pose = Pose(path[0].x, path[0].y, facing)

    # -- what can be seen of them --------------------------------------------------------------------------------------

    @cached_property
    def face(self) -> bytes:
        """What a recogniser makes of this face."""
        return hashlib.sha256(f"face of {self.key}".encode()).digest()

    @cached_property
    def voice(self) -> bytes:
        """What a recogniser makes of this voice."""
        return hashlib.sha256(f"voice of {self.key}".encode()).digest()

    @property
    def joints(self) -> Floats:
        """In their own frame, see ``figure``."""
        match self.doing:
            case Show(gesture=gesture):
                joints = figure.gesturing(gesture, self._elapsed)
            case Exercise(sport=sport, period=period):
                joints = figure.exercising(sport, self._elapsed / period)
            case _:
                joints = figure.walking(self._way) if self.walking else figure.UPRIGHT
        return joints * figure.size(self.person.height, self.person.radius)

    @property
    def showing(self) -> tuple[Show, float] | None:
        """The gesture they make and for how long they have made it, s."""
        return (self.doing, self._elapsed) if isinstance(self.doing, Show) else None

    def fetch(self) -> Sequence[Say | Clap]:
        """What they began to say or clap since the last time."""
        if not self._aloud:
            return ()
        aloud, self._aloud = self._aloud, []
        return aloud

    # -- what they are told --------------------------------------------------------------------------------------------

    def tell(self, step: Step) -> None:
        """Leave the script and do this, after what they were told before. Raises ValueError if that is too much."""
        if self._told is None:
            self.drop()
        assert self._told is not None
        if len(self._told) >= TOLD_MAX:
            raise ValueError(f"{self.key} remembers no more than {TOLD_MAX} steps")
        self._told.append(step)

    def drop(self) -> None:
        """Stop doing anything and stand."""
        self._told, self.doing = deque(), None

    def resume(self) -> None:
        """Go on with the script."""
        self._told, self.doing = None, None

    def place(self, pose: Pose) -> None:
        """Be there at once."""
        self.pose = pose
        self.displaced = True

    # -- time ----------------------------------------------------------------------------------------------------------

    def walk(self, seconds: float, robots: Iterable[Pose]) -> bool:
        """Go on for ``seconds``; whether the pose changed."""
        self.walking, moved, self.displaced = False, self.displaced, False
        if self.doing is None and not self._begin():
            return moved
        before, self._elapsed = self.pose, self._elapsed + seconds
        if self._do(seconds, robots):
            self.doing = None
        return moved or (self.pose is not before and self.pose != before)

    def _begin(self) -> bool:
        """Take up the next step, if there is any."""
        if self._told is not None:
            if not self._told:
                return False
            self.doing = self._told.popleft()
        elif self._script:
            self.doing = self._script[self._number % len(self._script)]
            self._number += 1
        self._elapsed = 0.0
        match self.doing:
            case Say() | Clap():
                self._aloud.append(self.doing)
            case Feel(emotion=emotion):
                self.emotion = emotion
        return self.doing is not None

    def _do(self, seconds: float, robots: Iterable[Pose]) -> bool:
        """Whether the step is over."""
        match self.doing:
            case Walk(to=to, speed=speed):
                return self._go(*to, (speed or self.person.speed) * seconds, robots)
            case Look(at=at):
                return self._turn(self.pose.point.bearing_to(Point(*at)), TURN_RATE * seconds)
            case Wait(seconds=span) | Show(seconds=span):
                return self._elapsed >= span
            case Say(text=text):
                return self._elapsed >= speaking_time(text)
            case Clap(count=count):
                return self._elapsed >= count * CLAP_PAUSE
            case Exercise(count=count, period=period):
                return self._elapsed >= count * period
            case _:
                return True

    def _go(self, x: float, y: float, step: float, robots: Iterable[Pose]) -> bool:
        """A step of so many metres towards (x, y), unless a robot is close and in the way."""
        pose = self.pose
        left = math.hypot(x - pose.x, y - pose.y)
        heading = math.atan2(y - pose.y, x - pose.x) if left > 1e-9 else pose.yaw
        c, s = math.cos(heading), math.sin(heading)
        for robot in robots:
            off_x, off_y = robot.x - pose.x, robot.y - pose.y
            if 0.0 < c * off_x + s * off_y < MANNERS and abs(c * off_y - s * off_x) < SIDE:
                return False
        self.walking = True
        self._way += min(step, left)
        if left <= step:
            self.pose = Pose(x, y, heading)
            return True
        self.pose = Pose(pose.x + step * c, pose.y + step * s, heading)
        return False

    def _turn(self, heading: float, step: float) -> bool:
        off = math.remainder(heading - self.pose.yaw, math.tau)
        turned = self.pose.yaw + max(-step, min(step, off))
        self.pose = Pose(self.pose.x, self.pose.y, math.remainder(turned, math.tau))
        return abs(off) <= step


def _strolling(person: Person) -> Iterator[Step]:
    """There and back along the path."""
    if len(person.path) > 1:
        for spot in (*person.path[1:], *reversed(person.path[:-1])):
            yield Wait(person.pause)
            yield Walk(spot)


def keyed(people: Sequence[Sequence[Person]]) -> list[Walker]:
    """All people of the floors."""
    return [
        Walker(person, floor, f"person {floor} {index}")
        for floor, there in enumerate(people)
        for index, person in enumerate(there)
    ]
