"""People: walk their paths, follow scripts, stop before a robot right in front of them, and step aside if it does not
move. Knows no physics.
"""

from __future__ import annotations

import hashlib
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

from roboglot.model.geometry import Point, Pose
from roboglot.simulation.people import figure
from roboglot.simulation.people.figure import Floats
from roboglot.simulation.people.person_state import PersonState
from roboglot.simulation.people.routine import Clap, Exercise, Feel, Look, Say, Show, Step, Wait, Walk
from roboglot.simulation.sound.voice import speaking_time
from roboglot.simulation.world.description import Person

MANNERS = 0.8  # m in front of a robot at which people wait
SIDE = 0.55  # m to the side at which they still pass it
PATIENCE = 2.5  # s for which they wait for a robot before they step aside
NEAR = 1.0  # m along an axis beyond which no robot is in the way: more than the diagonal of these two
ASIDE = 0.75  # m by which they step aside, or back
APART = 0.45  # m from a robot's centre that they always keep
TURN_RATE = 2.5  # rad/s
CLAP_PAUSE = 0.35  # s between claps
ORDERS_MAX = 100  # steps queued per person
AHEAD_MAX = 500  # ticks of a wait that are counted ahead


Spots = Sequence[tuple[float, float]]  # places of robots on the floor, m
Free = Callable[["Walker", Point], bool]  # whether the person can walk straight to that place


class Walker(PersonState):
    """One person: pose, present step and emotion. ``body``: the person's name in the physics.

    It also names a person without a name. ``look``: number of the clothes.
    """

    def __init__(self, person: Person, floor: int, body: str = "", look: int = 0) -> None:
        super().__init__(floor)
        self.person, self.floor, self.key, self.body, self.look = person, floor, person.name or body, body, look
        self.emotion = person.emotion
        self.displaced = False  # whether they were moved since the last tick
        self.aloud: list[Say | Clap] = []  # words and claps begun since the last fetch
        self._script = person.script or tuple(_strolling(person))
        self._number = 0
        self._orders: deque[Step] | None = None  # None: their own routine
        self.doing: Step | None = None
        self._elapsed = 0.0
        self._dodging: Point | None = None  # their destination while they let a robot pass
        path = [Point(*spot) for spot in person.path]
        facing = path[0].bearing_to(path[1]) if len(path) > 1 else 0.0
        if person.facing is not None:
            facing = math.radians(person.facing)
        self.pose = Pose(path[0].x, path[0].y, facing)

    # -- appearance --

    @cached_property
    def face(self) -> bytes:
        """Faceprint of the person."""
        return hashlib.sha256(f"face of {self.key}".encode()).digest()

    @cached_property
    def voice(self) -> bytes:
        """Voiceprint of the person."""
        return hashlib.sha256(f"voice of {self.key}".encode()).digest()

    @property
    def joints(self) -> Floats:
        """Return the joints in the person's own frame, see ``figure``."""
        match self.doing:
            case Show(gesture=gesture):
                joints = figure.gesturing(gesture, self._elapsed)
            case Exercise(sport=sport, period=period):
                joints = figure.exercising(sport, self._elapsed / period)
            case _:
                joints = figure.walking(self.way) if self.walking else figure.UPRIGHT
        return joints * figure.size(self.person.height, self.person.radius)

    @property
    def showing(self) -> tuple[Show, float] | None:
        """Present gesture, and its time so far, s; None: there is none."""
        return (self.doing, self._elapsed) if isinstance(self.doing, Show) else None

    def fetch(self) -> Sequence[Say | Clap]:
        """Return the words and claps begun since the last call."""
        aloud, self.aloud = self.aloud, []
        return aloud

    # -- orders --

    def order(self, step: Step) -> None:
        """Leave the script, and queue a step after earlier orders. Raises ValueError for too many."""
        if self._orders is None:
            self.drop()
        assert self._orders is not None
        if len(self._orders) >= ORDERS_MAX:
            raise ValueError(f"{self.key} remembers no more than {ORDERS_MAX} steps")
        self._orders.append(step)
        self.acts()

    def drop(self) -> None:
        """Drop all orders, and stand."""
        self._orders, self.doing, self._dodging = deque(), None, None
        self.cease()

    def resume(self) -> None:
        """Continue the script."""
        self._orders, self.doing = None, None
        self.cease()

    def place(self, pose: Pose) -> None:
        """Set the pose (world) at once."""
        self.pose, self.displaced = pose, True
        self.acts()

    @property
    def follows_script(self) -> bool:
        """True while the person follows the world's file and not an order."""
        return self._orders is None

    # -- time --

    def walk(self, seconds: float, robots: Spots, free: Free) -> bool:
        """Continue for ``seconds`` among the ``robots`` of the floor; return whether the pose changed.

        A kernel does the same for those who only walk or wait (``kernels/ticks.py``).
        """
        moved, self.displaced, self.walking = self.displaced, False, False
        before = self.pose
        if self.idle:
            self.idle -= 1
        elif self.doing is not None or self._begin():
            self._continue(robots, seconds, free)
        self._note(seconds)
        after = self.pose
        return moved or (after is not before and after != before)

    def _continue(self, robots: Spots, seconds: float, free: Free) -> None:
        """Continue the present step."""
        self._elapsed += seconds
        match self.doing:
            case Walk() as doing:
                over = self._walk_on(doing, robots, seconds, free)
            case Wait(seconds=span):
                over = self._wait(span, seconds)
            case _:
                over = self._do(seconds)
        if over:
            self.doing = None

    def _note(self, seconds: float) -> None:
        """Update the kernel's row of the next step."""
        if isinstance(self.doing, Walk) and self._dodging is None:
            self.note_walk(self.doing.to, self.doing.speed or self.person.speed, seconds)
        else:
            self.note_pause(stands=self.doing is None and not (self._script if self._orders is None else self._orders))

    def _begin(self) -> bool:
        """Begin the next step; return whether there is one."""
        if self._orders is not None:
            if not self._orders:
                return False
            self.doing = self._orders.popleft()
        elif self._script:
            self.doing = self._script[self._number % len(self._script)]
            self._number += 1
        self._elapsed = 0.0
        match self.doing:
            case Say() | Clap():
                self.aloud.append(self.doing)
            case Feel(emotion=emotion):
                self.emotion = emotion
        return self.doing is not None

    def _wait(self, span: float, seconds: float) -> bool:
        """Wait for ``span`` s; return whether it is over. Counts further ticks of ``seconds`` to skip."""
        elapsed, idle = self._elapsed, 0
        if elapsed >= span:
            return True
        while idle < AHEAD_MAX and elapsed + seconds < span:  # summed tick by tick, to the last bit
            elapsed += seconds
            idle += 1
        self._elapsed, self.idle = elapsed, idle
        return False

    def _do(self, seconds: float) -> bool:
        """Continue a step other than Walk and Wait; return whether it is over."""
        match self.doing:
            case Look(at=at):
                heading = self.pose.point.bearing_to(Point(*at))
                self.pose, there = _turned(self.pose, heading, TURN_RATE * seconds)
                return there
            case Show(seconds=span):
                return self._elapsed >= span
            case Say(text=text):
                return self._elapsed >= speaking_time(text)
            case Clap(count=count):
                return self._elapsed >= count * CLAP_PAUSE
            case Exercise(count=count, period=period):
                return self._elapsed >= count * period
            case _:
                return True

    def _walk_on(self, walk: Walk, robots: Spots, seconds: float, free: Free) -> bool:
        """Walk on, unless a robot is in the way; return whether the goal is reached."""
        if self._dodging is not None:
            self._dodge(self._dodging, robots, self.person.speed * seconds)
            return False
        (x, y), pose = walk.to, self.pose
        dx, dy = x - pose.x, y - pose.y
        left = math.sqrt(dx * dx + dy * dy)
        heading = math.atan2(dy, dx) if left > 1e-9 else pose.yaw
        c, s = math.cos(heading), math.sin(heading)
        here_x, here_y = pose.x, pose.y
        for robot_x, robot_y in robots:
            off_x, off_y = robot_x - here_x, robot_y - here_y
            if not (-NEAR < off_x < NEAR and -NEAR < off_y < NEAR):
                continue
            if 0.0 < c * off_x + s * off_y < MANNERS and abs(c * off_y - s * off_x) < SIDE:
                self._let_pass(heading, c * off_y - s * off_x, seconds, free)
                return False
        self.waited = 0.0
        return self._stride(x, y, (walk.speed or self.person.speed) * seconds, left, (heading, c, s))

    def _let_pass(self, heading: float, beside: float, seconds: float, free: Free) -> None:
        """Wait for a robot in the way; after a while, choose a place to step aside."""
        self.waited += seconds
        if self.waited >= PATIENCE:
            self.waited = 0.0
            self._dodging = self._way_out(heading, beside, free)

    def _way_out(self, heading: float, beside: float, free: Free) -> Point | None:
        """Return a place to the side with more room, else to the other, else behind; None: all are blocked."""
        side = -1.0 if beside >= 0.0 else 1.0
        for turn, way in ((side * math.pi / 2, ASIDE), (-side * math.pi / 2, ASIDE), (math.pi, 2.0 * ASIDE)):
            spot = Point(
                self.pose.x + way * math.cos(heading + turn),
                self.pose.y + way * math.sin(heading + turn),
            )
            if free(self, spot):
                return spot
        return None

    def _dodge(self, spot: Point, robots: Spots, step: float) -> None:
        """Step towards ``spot``, and end there or before a robot that is near."""
        before = self.pose
        there = self._step(spot.x, spot.y, step)
        spots = [Point(*robot) for robot in robots]
        if any(APART > spot.distance_to(self.pose) < spot.distance_to(before) for spot in spots):
            self.pose, self.walking, there = before, False, True
        if there:
            self._dodging = None

    def _step(self, x: float, y: float, step: float) -> bool:
        """Walk ``step`` m towards (x, y); return whether it is reached."""
        pose = self.pose
        left = math.sqrt((x - pose.x) ** 2 + (y - pose.y) ** 2)
        heading = math.atan2(y - pose.y, x - pose.x) if left > 1e-9 else pose.yaw
        return self._stride(x, y, step, left, (heading, math.cos(heading), math.sin(heading)))

    def _stride(self, x: float, y: float, step: float, left: float, way: tuple[float, float, float]) -> bool:
        """Walk ``step`` of ``left`` m to (x, y); return whether it is reached. ``way``: heading (rad), cosine, sine."""
        pose, (heading, c, s) = self.pose, way
        self.walking = True
        self.way += min(step, left)
        if left <= step:
            self.pose = Pose(x, y, heading)
            return True
        self.pose = Pose(pose.x + step * c, pose.y + step * s, heading)
        return False


def _turned(pose: Pose, heading: float, step: float) -> tuple[Pose, bool]:
    """Return a pose turned towards ``heading`` by ``step`` (rad) at most, and whether it is reached."""
    off = math.remainder(heading - pose.yaw, math.tau)
    turned = pose.yaw + max(-step, min(step, off))
    return Pose(pose.x, pose.y, math.remainder(turned, math.tau)), abs(off) <= step


def _strolling(person: Person) -> Iterator[Step]:
    """Yield the steps of a walk along the path and back."""
    if len(person.path) > 1:
        for spot in (*person.path[1:], *reversed(person.path[:-1])):
            yield Wait(person.pause)
            yield Walk(spot)


def keyed(people: Sequence[Sequence[Person]]) -> list[Walker]:
    """Return all people of the floors."""
    every = ((person, floor, index) for floor, there in enumerate(people) for index, person in enumerate(there))
    return [Walker(person, floor, f"person {floor} {index}", look) for look, (person, floor, index) in enumerate(every)]
