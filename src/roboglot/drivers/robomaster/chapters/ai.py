"""What an EP makes out in its pictures: people, gestures, markers, robots and lines, while somebody watches.

It looks for one of the first four at a time, and for markers and lines of one colour at a time.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Sequence
from typing import Generic, NoReturn, TypeVar

from roboglot.clients.errors import ClientError
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster.detections import Locator, PersonTracker, box_of, gesture_of, line_of
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import Clock
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import Busy, Refused, RobotError
from roboglot.model.feed import Feed, Viewer
from roboglot.model.perception import Colour, LineSeen, MarkerSeen, PersonSeen, RobotSeen, Sighting
from roboglot.wire.robomaster.telemetry import LinesSeen, Target, TargetsSeen, Telemetry

T = TypeVar("T")
P = TypeVar("P", PersonSeen, RobotSeen)
RATE = 10.0  # a second; not in the manual
QUEUE_MAX = 4  # sightings that a viewer may be behind
PICTURE_MAX = 1.0  # s to wait for what a picture shows in one colour
LINES = (Colour.RED, Colour.GREEN, Colour.BLUE)
MARKERS = (Colour.RED, Colour.BLUE)  # green ones only some builds know
EXCLUSIVE = ("person", "gesture", "marker", "robot")
ROBOTS_WORDS = {"person": "people", "gesture": "pose"}

Seen = TargetsSeen | LinesSeen


class DetectionSwitches:
    """Switches kinds on while they are watched, and hands what is told of them to who watches."""

    def __init__(self, client: RoboMasterClient, supervisor: Supervisor, clock: Clock) -> None:
        self.client, self.supervisor, self.clock = client, supervisor, clock
        self._watching: dict[str, Callable[[Seen], None]] = {}
        self._forget: Callable[[], None] = lambda: None

    async def learn(self) -> None:
        """Have told what is watched. Raises RefusedByRobot if it has no eyes."""
        await self.client.ai.push(line="line" in self._watching)
        for kind in self._watching:
            await self.switch(kind, True)
        self._forget()
        self._forget = self.client.listen(self._hear, TargetsSeen, LinesSeen)

    def watch(self, kind: str, heard: Callable[[Seen], None]) -> None:
        """From now on."""
        self._watching[kind] = heard
        with contextlib.suppress(RobotError):  # without a link: at the next connection
            self.supervisor.send(f"looking for a {kind}", self.switch(kind, True))

    def leave(self, kind: str) -> None:
        """No more."""
        del self._watching[kind]
        with contextlib.suppress(RobotError):
            self.supervisor.send(f"no longer looking for a {kind}", self.switch(kind, False))

    def rival(self, kind: str) -> str | None:
        """What else is watched that excludes ``kind``."""
        others = (other for other in self._watching if other != kind and other in EXCLUSIVE)
        return next(others, None) if kind in EXCLUSIVE else None

    async def switch(self, kind: str, on: bool) -> None:
        """Tell the robot, in its build's words."""
        word = ROBOTS_WORDS.get(kind, kind) if self.client.as_robots else kind
        await self.client.ai.push(**{word: on})

    def _hear(self, told: Telemetry) -> None:
        assert isinstance(told, TargetsSeen | LinesSeen)
        heard = self._watching.get("line" if isinstance(told, LinesSeen) else told.kind)
        if heard is not None:
            heard(told)


class RoboMasterDetector(Detector[T]):
    """One kind; ``read`` makes the model's values of what is told."""

    rate = RATE

    def __init__(self, switches: DetectionSwitches, kind: str, read: Callable[[Seen], Sequence[T]]) -> None:
        self._switches, self._kind, self._read = switches, kind, read
        self._feed: Feed[Sighting[T]] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._latest: Sighting[T] | None = None

    @property
    def latest(self) -> Sighting[T] | None:
        return self._latest

    def subscribe(self) -> Viewer[Sighting[T]]:
        if rival := self._switches.rival(self._kind):
            raise Busy(f"an EP that looks for a {rival} does not look for a {self._kind}")
        return self._feed.subscribe()

    def _begin(self) -> None:
        self._switches.watch(self._kind, self._hear)

    def _end(self) -> None:
        self._switches.leave(self._kind)
        self._latest = None

    def _hear(self, told: Seen) -> None:
        self._tell(self._read(told))

    def _tell(self, seen: Sequence[T]) -> None:
        self._latest = Sighting(self._switches.clock.time(), tuple(seen))
        self._feed.push(self._latest)


class ColourDetector(RoboMasterDetector[T]):
    """Looks for one colour after the other, and tells all when it is through."""

    def __init__(
        self,
        switches: DetectionSwitches,
        kind: str,
        attribute: str,
        colours: Sequence[Colour],
        read: Callable[[Seen, Colour], Sequence[T]],
    ) -> None:
        super().__init__(switches, kind, lambda told: ())
        self._attribute, self._colours, self._read_coloured = attribute, colours, read
        self._told: asyncio.Queue[Seen] = asyncio.Queue(maxsize=QUEUE_MAX)
        self._looking: asyncio.Task[None] | None = None

    def _begin(self) -> None:
        super()._begin()
        self._looking = asyncio.get_running_loop().create_task(self._look(), name=f"every colour of a {self._kind}")

    def _end(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None
        super()._end()

    def _hear(self, told: Seen) -> None:
        if self._told.full():
            self._told.get_nowait()
        self._told.put_nowait(told)

    async def _look(self) -> None:
        clock = self._switches.clock
        while True:
            seen: list[T] = []
            for colour in self._colours:
                with contextlib.suppress(ClientError, TimeoutError):
                    await self._switches.client.ai.attribute(**{self._attribute: colour.value})  # type: ignore[arg-type]
                    for _ in range(2):  # what was under way is of the colour before
                        told = await clock.wait_for(self._told.get(), PICTURE_MAX)
                    seen.extend(self._read_coloured(told, colour))
            if self._switches.supervisor.link.refusal is None:
                self._tell(seen)
            await clock.sleep(1 / self.rate)


class UnsupportedDetector(Detector[T], Generic[T]):
    """What an EP does not make out."""

    rate = 0.0

    def __init__(self, what: str) -> None:
        self._what = what

    @property
    def latest(self) -> Sighting[T] | None:
        return None

    def subscribe(self) -> NoReturn:
        raise Refused(f"an EP makes out no {self._what}")


class RoboMasterVision(Vision):
    """Distances follow from the size of boxes; whoever stays about in the same place keeps the number."""

    def __init__(self, clock: Clock, client: RoboMasterClient, supervisor: Supervisor, camera: Camera) -> None:
        switches = self._switches = DetectionSwitches(client, supervisor, clock)
        where = Locator(camera)
        people, makers = PersonTracker(), PersonTracker()

        def numbered(told: Seen, numbers: PersonTracker) -> list[tuple[Target, int]]:
            return list(zip(_targets(told), numbers.number([box_of(t) for t in _targets(told)]), strict=True))

        self.people = RoboMasterDetector(
            switches, "person", lambda told: _nearest([where.person(*each) for each in numbered(told, people)])
        )
        self.gestures = RoboMasterDetector(
            switches, "gesture", lambda told: [g for each in numbered(told, makers) if (g := gesture_of(*each))]
        )
        self.robots = RoboMasterDetector(
            switches, "robot", lambda told: _nearest([where.robot(target) for target in _targets(told)])
        )

        def markers(told: Seen, colour: Colour) -> list[MarkerSeen]:
            return [seen for target in _targets(told) if (seen := where.marker(target, colour))]

        def lines(told: Seen, colour: Colour) -> list[LineSeen]:
            return [line_of(points, colour) for points in told.lines] if isinstance(told, LinesSeen) else []

        self.markers = ColourDetector(switches, "marker", "marker_color", MARKERS, markers)
        self.lines = ColourDetector(switches, "line", "line_color", LINES, lines)
        self.faces, self.skeletons, self.tags = (
            UnsupportedDetector("faces"),
            UnsupportedDetector("skeletons"),
            UnsupportedDetector("codes"),
        )

    async def learn(self) -> None:
        """Raises RefusedByRobot if it makes out nothing."""
        await self._switches.learn()


def _targets(told: Seen) -> Sequence[Target]:
    return told.targets if isinstance(told, TargetsSeen) else ()


def _nearest(seen: Sequence[P]) -> list[P]:
    return sorted(seen, key=lambda each: each.distance)
