"""Visual detection by an EP: people, gestures, markers, robots and lines, switched on while a client watches.

An EP detects one of the first four kinds at a time, and markers and lines of one colour at a time.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Sequence
from typing import Generic, NoReturn, TypeVar

from roboglot.clients.errors import ClientError
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster.chapters.ai.detections import Locator, PersonTracker, box_of, gesture_of, line_of
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
RATE = 10.0  # Hz; not in the manual
QUEUE_MAX = 4  # sightings that a viewer may lag behind
PICTURE_MAX = 1.0  # s to wait for the detections in one colour
LINES = (Colour.RED, Colour.GREEN, Colour.BLUE)
MARKERS = (Colour.RED, Colour.BLUE)  # only some builds detect green ones
EXCLUSIVE = ("person", "gesture", "marker", "robot")
ROBOTS_WORDS = {"person": "people", "gesture": "pose"}

Seen = TargetsSeen | LinesSeen


class DetectionSwitches:
    """Switches kinds of detection on while they have a listener and passes their pushes on."""

    def __init__(self, client: RoboMasterClient, supervisor: Supervisor, clock: Clock) -> None:
        self.client, self.supervisor, self.clock = client, supervisor, clock
        self._watching: dict[str, Callable[[Seen], None]] = {}
        self._forget: Callable[[], None] = lambda: None

    async def probe(self) -> None:
        """Switch the watched kinds on. Raises RefusedByRobot if the robot has no detection."""
        await self.client.ai.push(line="line" in self._watching)
        for kind in self._watching:
            await self.switch(kind, True)
        self._forget()
        self._forget = self.client.listen(self._on_push, TargetsSeen, LinesSeen)

    def watch(self, kind: str, heard: Callable[[Seen], None]) -> None:
        """Switch ``kind`` on and pass its pushes to ``heard``."""
        self._watching[kind] = heard
        with contextlib.suppress(RobotError):  # without a link: at the next connection
            self.supervisor.send(f"looking for a {kind}", self.switch(kind, True), always=True)

    def leave(self, kind: str) -> None:
        """Switch ``kind`` off."""
        del self._watching[kind]
        with contextlib.suppress(RobotError):
            self.supervisor.send_aside(f"no longer looking for a {kind}", self.switch(kind, False))

    def rival(self, kind: str) -> str | None:
        """Return a watched kind that excludes ``kind``, or None."""
        others = (other for other in self._watching if other != kind and other in EXCLUSIVE)
        return next(others, None) if kind in EXCLUSIVE else None

    async def switch(self, kind: str, on: bool) -> None:
        """Send the switch in the vocabulary of the robot's build."""
        word = ROBOTS_WORDS.get(kind, kind) if self.client.as_robots else kind
        await self.client.ai.push(**{word: on})

    def _on_push(self, push: Telemetry) -> None:
        assert isinstance(push, TargetsSeen | LinesSeen)
        heard = self._watching.get("line" if isinstance(push, LinesSeen) else push.kind)
        if heard is not None:
            heard(push)


class RoboMasterDetector(Detector[T]):
    """Detector of one kind; ``read`` converts a push to the model's values."""

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
        self._switches.watch(self._kind, self._on_push)

    def _end(self) -> None:
        self._switches.leave(self._kind)
        self._latest = None

    def _on_push(self, push: Seen) -> None:
        self._publish(self._read(push))

    def _publish(self, seen: Sequence[T]) -> None:
        self._latest = Sighting(self._switches.clock.time(), tuple(seen))
        self._feed.push(self._latest)


class ColourDetector(RoboMasterDetector[T]):
    """Scans one colour after the other and publishes all of them together."""

    def __init__(
        self,
        switches: DetectionSwitches,
        kind: str,
        attribute: str,
        colours: Sequence[Colour],
        read: Callable[[Seen, Colour], Sequence[T]],
    ) -> None:
        super().__init__(switches, kind, lambda _: ())
        self._attribute, self._colours, self._read_coloured = attribute, colours, read
        self._pushes: asyncio.Queue[Seen] = asyncio.Queue(maxsize=QUEUE_MAX)
        self._looking: asyncio.Task[None] | None = None

    def _begin(self) -> None:
        super()._begin()
        self._looking = asyncio.get_running_loop().create_task(self._look(), name=f"every colour of a {self._kind}")

    def _end(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None
        super()._end()

    def _on_push(self, push: Seen) -> None:
        if self._pushes.full():
            self._pushes.get_nowait()
        self._pushes.put_nowait(push)

    async def _look(self) -> None:
        clock = self._switches.clock
        while True:
            seen: list[T] = []
            for colour in self._colours:
                with contextlib.suppress(ClientError, TimeoutError):
                    await self._switches.client.ai.attribute(**{self._attribute: colour.value})  # type: ignore[arg-type]
                    for _ in range(2):  # the first may still be of the previous colour
                        push = await clock.wait_for(self._pushes.get(), PICTURE_MAX)
                    seen.extend(self._read_coloured(push, colour))
            if self._switches.supervisor.link.refusal is None:
                self._publish(seen)
            await clock.sleep(1 / self.rate)


class UnsupportedDetector(Detector[T], Generic[T]):
    """Detector of a kind that an EP cannot detect."""

    rate = 0.0

    def __init__(self, what: str) -> None:
        self._what = what

    @property
    def latest(self) -> Sighting[T] | None:
        return None

    def subscribe(self) -> NoReturn:
        raise Refused(f"an EP cannot detect {self._what}")


class RoboMasterVision(Vision):
    """Distances follow from box sizes; a person who stays in about the same place keeps the number."""

    def __init__(self, clock: Clock, client: RoboMasterClient, supervisor: Supervisor, camera: Camera) -> None:
        switches = self._switches = DetectionSwitches(client, supervisor, clock)
        where = Locator(camera)
        people, gesturers = PersonTracker(), PersonTracker()

        def numbered(push: Seen, numbers: PersonTracker) -> list[tuple[Target, int]]:
            return list(zip(_targets(push), numbers.number([box_of(t) for t in _targets(push)]), strict=True))

        self.people = RoboMasterDetector(
            switches, "person", lambda push: _nearest([where.person(*each) for each in numbered(push, people)])
        )
        self.gestures = RoboMasterDetector(
            switches, "gesture", lambda push: [g for each in numbered(push, gesturers) if (g := gesture_of(*each))]
        )
        self.robots = RoboMasterDetector(
            switches, "robot", lambda push: _nearest([where.robot(target) for target in _targets(push)])
        )

        def markers(push: Seen, colour: Colour) -> list[MarkerSeen]:
            return [seen for target in _targets(push) if (seen := where.marker(target, colour))]

        def lines(push: Seen, colour: Colour) -> list[LineSeen]:
            return [line_of(points, colour) for points in push.lines] if isinstance(push, LinesSeen) else []

        self.markers = ColourDetector(switches, "marker", "marker_color", MARKERS, markers)
        self.lines = ColourDetector(switches, "line", "line_color", LINES, lines)
        self.faces, self.skeletons, self.tags = (
            UnsupportedDetector("faces"),
            UnsupportedDetector("skeletons"),
            UnsupportedDetector("codes"),
        )

    async def probe(self) -> None:
        """Probe the detection. Raises RefusedByRobot if there is none."""
        await self._switches.probe()


def _targets(push: Seen) -> Sequence[Target]:
    return push.targets if isinstance(push, TargetsSeen) else ()


def _nearest(seen: Sequence[P]) -> list[P]:
    return sorted(seen, key=lambda each: each.distance)
