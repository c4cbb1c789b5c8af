"""Choice of the person or thing to follow: tracking boxes for the app (push 6007), its choice (6008)."""

from __future__ import annotations

import asyncio

from roboglot.model.components.motion.following import Following
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.geometry import Point
from roboglot.model.perception import Box, PersonSeen
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.chapters.camera.projection import CameraView, Extent
from roboglot.protocols.cyberdog.table import push
from roboglot.wire.cyberdog.codes import Code

TRACKING = push(Code.TRACKING, depth=2)
WIDTH, HEIGHT = 640, 480  # pixels: the picture to which boxes refer, whatever the camera's size
PERIOD = 0.2  # s between two pushes
OVERLAP_MIN = 0.1  # overlap, as a share of the union, from which two boxes mean the same object


class Pursuit:
    """Pushes boxes from ``watch`` on; ``chosen``: number of the person that the app has chosen."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self.chosen: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self._robot, self._app = robot, app
        self._seen: tuple[PersonSeen, ...] = ()

    async def watch(self) -> None:
        """Push the people in sight until cancelled."""
        reported_at = -PERIOD
        with self._robot[Vision].people.subscribe() as sightings:
            async for sighting in sightings:
                self._seen = sighting.seen
                if sighting.stamp - reported_at >= PERIOD:
                    reported_at = sighting.stamp
                    self._app.push(TRACKING, self._boxes())

    def choose(self, x: int, y: int, width: int, height: int) -> bool:
        """Choose the person whose box fits this one best (pixels); False if none does, or one is chosen already."""
        if self.chosen.done() or width <= 0 or height <= 0:
            return False
        box = _box(x, y, width, height)
        fit, number = max(((_overlap(box, person.box), person.number) for person in self._seen), default=(0.0, 0))
        if fit < OVERLAP_MIN:
            return False
        self.chosen.set_result(number)
        return True

    def _boxes(self) -> dict[str, object]:
        number = self.chosen.result() if self.chosen.done() and not self.chosen.cancelled() else None
        tracked = next((person.box for person in self._seen if person.number == number), Box(0, 0, 0, 0))
        people = [{"roi": _region(person.box), "reid": str(person.number)} for person in self._seen]
        return {"body_info_roi": people, "track_res_roi": _region(tracked)}


class ThingPursuit:
    """Choice of an object: no boxes until the app has chosen a region; ``chosen``: its place in base_link (m)."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self.chosen: asyncio.Future[Point] = asyncio.get_running_loop().create_future()
        self._robot, self._app = robot, app
        self._extent = Extent(0.0, 0.0, 0.0)  # of the chosen object

    def choose(self, x: int, y: int, width: int, height: int) -> bool:
        """Choose the lidar's nearest object in that region (pixels); False if there is none, or one is chosen."""
        scan = self._robot[Lidar].scan
        if self.chosen.done() or width <= 0 or height <= 0 or scan is None:
            return False
        box, view = _box(x, y, width, height), CameraView(self._robot[Camera])
        place = view.nearest(box, scan)
        if place is None:
            return False
        self._extent = view.extent(box, place)
        self.chosen.set_result(place)
        return True

    async def watch(self) -> None:
        """Push the object's place in the picture until cancelled."""
        async for _ in self._robot.clock.every(PERIOD):
            place = self._robot[Following].place if self.chosen.done() else None
            if place is not None:
                box = CameraView(self._robot[Camera]).box(self._extent, place)
                self._app.push(TRACKING, {"body_info_roi": [], "track_res_roi": _region(box)})


def _box(x: int, y: int, width: int, height: int) -> Box:
    """Region that the app chose, as shares of the picture."""
    return Box((x + width / 2) / WIDTH, (y + height / 2) / HEIGHT, width / WIDTH, height / HEIGHT)


def _edges(box: Box) -> tuple[float, float, float, float]:
    """Return left, top, right, bottom, clipped to the picture."""
    x, y = box.width / 2, box.height / 2
    left, top, right, bottom = (max(0.0, min(1.0, e)) for e in (box.x - x, box.y - y, box.x + x, box.y + y))
    return left, top, right, bottom


def _region(box: Box) -> dict[str, int]:
    left, top, right, bottom = _edges(box)
    return {
        "x_offset": round(left * WIDTH),
        "y_offset": round(top * HEIGHT),
        "height": round((bottom - top) * HEIGHT),
        "width": round((right - left) * WIDTH),
    }


def _overlap(a: Box, b: Box) -> float:
    """Return intersection over union."""
    one, other = _edges(a), _edges(b)
    wide, high = min(one[2], other[2]) - max(one[0], other[0]), min(one[3], other[3]) - max(one[1], other[1])
    both = max(0.0, wide) * max(0.0, high)
    union = sum((right - left) * (bottom - top) for left, top, right, bottom in (one, other)) - both
    return both / union if union > 0.0 else 0.0
