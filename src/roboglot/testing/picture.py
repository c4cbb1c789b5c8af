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
    from PIL import Image, ImageDraw, ImageFont

    spots = [point for polygon in (*floor.walls, *floor.furniture) for point in polygon]
    spots += [Point(placed.pose.x, placed.pose.y) for placed in robots]
    spots += [Point(x, y) for track in tracks.values() for x, y in track]
    left, low = min((p.x for p in spots), default=0.0) - MARGIN, min((p.y for p in spots), default=0.0) - MARGIN
    width = max((p.x for p in spots), default=1.0) + MARGIN - left
    height = max((p.y for p in spots), default=1.0) + MARGIN - low
    scale = SIDE / max(width, height)

    def at(x: float, y: float) -> tuple[float, float]:
        return (x - left) * scale, (low + height - y) * scale

    image = Image.new("RGB", (max(1, round(width * scale)), max(1, round(height * scale))), BACK)
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(16)
    for polygons, colour in ((floor.furniture, FURNITURE), (floor.walls, WALL)):
        for polygon in polygons:
            corners = [at(point.x, point.y) for point in polygon]
            if len(corners) > 2:
                pen.polygon(corners, fill=colour, outline=WALL)
            elif len(corners) == 2:
                pen.line(corners, fill=WALL, width=2)
    for person in people:
        x, y = at(person.pose.x, person.pose.y)
        pen.ellipse((x - 6, y - 6, x + 6, y + 6), outline=PERSON, width=2)
    for number, robot in enumerate(robots):
        colour, track = COLOURS[number % len(COLOURS)], [at(*spot) for spot in tracks.get(robot.name, ())]
        if len(track) > 1:
            pen.line(track, fill=colour, width=3, joint="curve")
        x, y = at(robot.pose.x, robot.pose.y)
        pen.ellipse((x - 8, y - 8, x + 8, y + 8), fill=colour)
        pen.text((x + 10, y - 8), robot.name, fill=INK, font=font)
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()
