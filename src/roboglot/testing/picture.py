"""The world from above with the robots' tracks, as a PNG."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

from roboglot.model.geometry import Point
from roboglot.model.stage import FloorPlan, Placed

SIDE = 1000  # pixels along the longer side
MARGIN = 0.5  # m
BACK, WALL, FURNITURE, PERSON, INK = "#fafaf8", "#2b3038", "#cdd1d6", "#6a4c93", "#2b3038"
COLOURS = ("#d1495b", "#00798c", "#edae49", "#66a182", "#2e4057")
Track = Sequence[tuple[float, float]]


def picture(floor: FloorPlan, robots: Sequence[Placed], people: Sequence[Placed], tracks: Mapping[str, Track]) -> bytes:
    """Return a PNG of the floor with robots, people and tracks; x to the right, y up."""
    spots = [point for polygon in (*floor.walls, *floor.furniture) for point in polygon]
    spots += [Point(placed.pose.x, placed.pose.y) for placed in robots]
    spots += [Point(x, y) for track in tracks.values() for x, y in track]
    sheet = _Sheet(spots)
    for polygons, colour in ((floor.furniture, FURNITURE), (floor.walls, WALL)):
        for polygon in polygons:
            sheet.draw_polygon(polygon, colour)
    for person in people:
        sheet.draw_person(person)
    for number, robot in enumerate(robots):
        sheet.draw_robot(robot, COLOURS[number % len(COLOURS)], tracks.get(robot.name, ()))
    file = io.BytesIO()
    sheet.image.save(file, "PNG")
    return file.getvalue()


class _Sheet:
    """Empty picture that is large enough for ``spots`` (m)."""

    def __init__(self, spots: Sequence[Point]) -> None:
        from PIL import Image, ImageDraw, ImageFont

        self._left = min((p.x for p in spots), default=0.0) - MARGIN
        low = min((p.y for p in spots), default=0.0) - MARGIN
        self._top = max((p.y for p in spots), default=1.0) + MARGIN
        width, height = max((p.x for p in spots), default=1.0) + MARGIN - self._left, self._top - low
        self._scale = SIDE / max(width, height)
        size = max(1, round(width * self._scale)), max(1, round(height * self._scale))
        self.image = Image.new("RGB", size, BACK)
        self._pen, self._font = ImageDraw.Draw(self.image), ImageFont.load_default(16)

    def _at(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel of a place."""
        return (x - self._left) * self._scale, (self._top - y) * self._scale

    def draw_polygon(self, polygon: Sequence[Point], colour: str) -> None:
        """Draw a piece of the building, or a line for one with two corners."""
        corners = [self._at(point.x, point.y) for point in polygon]
        if len(corners) > 2:
            self._pen.polygon(corners, fill=colour, outline=WALL)
        elif len(corners) == 2:
            self._pen.line(corners, fill=WALL, width=2)

    def draw_person(self, person: Placed) -> None:
        """Draw a ring."""
        x, y = self._at(person.pose.x, person.pose.y)
        self._pen.ellipse((x - 6, y - 6, x + 6, y + 6), outline=PERSON, width=2)

    def draw_robot(self, robot: Placed, colour: str, track: Track) -> None:
        """Draw a disc, the robot's name and its track."""
        if len(track) > 1:
            self._pen.line([self._at(*spot) for spot in track], fill=colour, width=3, joint="curve")
        x, y = self._at(robot.pose.x, robot.pose.y)
        self._pen.ellipse((x - 8, y - 8, x + 8, y + 8), fill=colour)
        self._pen.text((x + 10, y - 8), robot.name, fill=INK, font=self._font)
