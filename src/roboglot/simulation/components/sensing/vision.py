"""Detectors of the camera's pictures: each looks at its rate while it has viewers, and reports a moment later.

No picture is drawn: detections follow from the camera's view and the world's geometry.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Annotated, TypeVar

from msgspec import Meta, Struct

from roboglot.model.clock import Clock
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.feed import Feed, Viewer
from roboglot.model.perception import Sighting
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.detectors.bodies import see_faces, see_gestures, see_people, see_robots, see_skeletons
from roboglot.simulation.detectors.cards import see_markers, see_tags
from roboglot.simulation.detectors.lines import see_lines
from roboglot.simulation.detectors.observation import Observation, Surroundings
from roboglot.simulation.rendering.projection import view_of
from roboglot.simulation.world.randomness import RandomStreams

T = TypeVar("T")
log = logging.getLogger(__name__)
QUEUE_MAX = 4  # sightings by which a viewer may lag


class VisionSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Detectors on the camera's pictures, ``rate`` times a second."""

    rate: Annotated[float, Meta(gt=0, le=30)] = 12.5


class SimulatedDetector(Detector[T]):
    """Detector; ``look`` returns the present detections, ``looks`` counts its calls."""

    def __init__(self, name: str, rate: float, clock: Clock, look: Callable[[], list[T]]) -> None:
        self.rate = rate
        self._name, self._clock, self._look = name, clock, look
        self._feed: Feed[Sighting[T]] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._latest: Sighting[T] | None = None
        self._looking: asyncio.Task[None] | None = None
        self.looks = 0

    @property
    def latest(self) -> Sighting[T] | None:
        return self._latest

    def subscribe(self) -> Viewer[Sighting[T]]:
        return self._feed.subscribe()

    def close(self) -> None:
        """Stop detecting."""
        self._feed.close()

    def _begin(self) -> None:
        self._looking = asyncio.get_running_loop().create_task(self._watch(), name=f"detector of {self._name}")

    def _end(self) -> None:
        self._latest = None
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None

    async def _watch(self) -> None:
        ready: Sighting[T] | None = None  # the work in progress until the next beat
        try:
            async for stamp in self._clock.every(1.0 / self.rate):
                if ready is not None:
                    self._latest = ready
                    self._feed.push(ready)
                self.looks += 1
                ready = Sighting(stamp, tuple(self._look()))
        except Exception:
            log.exception("the detector of %s crashed", self._name)
            self._looking = None
            self._feed.close()


class SimulatedVision(Vision):
    """Vision that numbers people alike in all detectors."""

    def __init__(
        self,
        section: VisionSection,
        robot: Robot,
        camera: Camera,
        hull: Hull,
        around: Surroundings,
        chances: RandomStreams,
    ) -> None:
        self._section, self._robot, self._camera, self._hull = section, robot, camera, hull
        self._around, self._chances = around, chances
        self._numbers: dict[str, int] = {}
        self._closing: list[Callable[[], None]] = []  # ends of the detectors
        self.people = self._detector("people", see_people)
        self.faces = self._detector("faces", see_faces)
        self.gestures = self._detector("gestures", see_gestures)
        self.skeletons = self._detector("skeletons", see_skeletons)
        self.markers = self._detector("markers", see_markers)
        self.lines = self._detector("lines", see_lines)
        self.robots = self._detector("robots", see_robots)
        self.tags = self._detector("tags", see_tags)

    def close(self) -> None:
        """Stop all detectors."""
        for close in self._closing:
            close()

    def _detector(self, name: str, see: Callable[[Observation], list[T]]) -> SimulatedDetector[T]:
        random = self._chances.of(self._robot.id, "vision", name)

        def look() -> list[T]:
            view, known = view_of(self._camera, self._hull), self._faces()
            return see(Observation(self._around, self._hull, view, random, self._numbers, known))

        detector = SimulatedDetector(name, self._section.rate, self._robot.clock, look)
        self._closing.append(detector.close)
        return detector

    def _faces(self) -> dict[bytes, str]:
        """Return the names of members by their enrolled faces."""
        if Members not in self._robot:
            return {}
        return {member.face: member.name for member in self._robot[Members].all() if member.face is not None}


def _fit(fit: Fitting) -> SimulatedVision:
    section, camera = fit.body[VisionSection], fit.robot[Camera]
    return SimulatedVision(section, fit.robot, camera, fit.hull, fit.world.surroundings, fit.world.chances)


PART = Part(
    name="vision",
    interface=Vision,
    section=VisionSection,
    needs=("camera",),
    fit=_fit,
    after=("camera",),
    detach=SimulatedVision.close,
)
