"""Draws the pictures of docs/worlds/simulation.md: .venv/bin/python scripts/pictures.py [folder]"""

from __future__ import annotations

import asyncio
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import Action
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.motion.tag_docking import Mark, MarkGoal, TagDocking
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.geometry import Pose
from roboglot.simulation.building.blueprint import solids_of
from roboglot.storage.database import Database

ROOT = Path(__file__).parent.parent
COLOURS = 64  # of a PNG
INK, WALL, FREE, RED, GREEN, BLUE, GOLD = "#2b3038", "#8b919b", "#eef3ee", "#d1495b", "#2a9d58", "#00798c", "#e09f1f"
Spot = tuple[float, float]


class Plan:
    """A floor from above: world metres in, pixels out."""

    def __init__(self, fleet: Fleet, low: Spot, high: Spot, scale: float) -> None:
        self._low, self._high, self._scale = low, high, scale
        size = (round((high[0] - low[0]) * scale), round((high[1] - low[1]) * scale))
        self.image = Image.new("RGB", size, "white")
        self.pen, self._font = ImageDraw.Draw(self.image), ImageFont.load_default(17)
        world = fleet.world.description
        self._walls = list(solids_of(world.floors[0], world.lift, lift_here=True))

    def at(self, x: float, y: float) -> Spot:
        return (x - self._low[0]) * self._scale, (self._high[1] - y) * self._scale

    def walls(self, fill: str | None = WALL, outline: str | None = None) -> None:
        for solid in self._walls:
            w, d = solid.size[0] / 2, solid.size[1] / 2
            corners = [solid.pose.compose(Pose(x, y)) for x, y in ((w, d), (-w, d), (-w, -d), (w, -d))]
            self.pen.polygon([self.at(corner.x, corner.y) for corner in corners], fill=fill, outline=outline)

    def dots(self, points: Sequence[Spot], colour: str, radius: float = 2.0) -> None:
        for x, y in (self.at(*point) for point in points):
            self.pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour)

    def line(self, points: Sequence[Spot], colour: str, width: int = 3) -> None:
        self.pen.line([self.at(*point) for point in points], fill=colour, width=width, joint="curve")

    def robot(self, pose: Pose, colour: str, radius: float = 0.27) -> None:
        (x, y), r = self.at(pose.x, pose.y), radius * self._scale
        self.pen.ellipse((x - r, y - r, x + r, y + r), outline=colour, width=3)
        self.line(
            [(pose.x, pose.y), (pose.x + radius * math.cos(pose.yaw), pose.y + radius * math.sin(pose.yaw))], colour
        )

    def legend(self, *entries: tuple[str, str]) -> None:
        for row, (colour, text) in enumerate(entries):
            self.pen.rectangle((10, 10 + 22 * row, 26, 24 + 22 * row), fill=colour)
            self.pen.text((32, 7 + 22 * row), text, fill=INK, font=self._font)

    def save(self, path: Path) -> None:
        store(self.image, path)


def store(image: Image.Image, path: Path) -> None:
    image.quantize(COLOURS).save(path, optimize=True)
    print(path, path.stat().st_size // 1000, "kB")


async def until_done(clock: LockstepClock, action: Action, watch: Callable[[], object]) -> None:
    while not action.status.ended:
        await clock.advance(0.2)
        watch()
    assert not action.reason, action.reason


async def scan(fleet: Fleet, clock: LockstepClock, folder: Path) -> None:
    """One scan over the true floor plan."""
    fleet.world.stage.place("a", Pose(12.0, 9.8, math.radians(20)))
    await clock.advance(3.0)
    here, seen = fleet.world.truth.pose_of("a"), fleet.robots["a"][Lidar].scan
    assert seen is not None
    plan = Plan(fleet, (4.0, 4.0), (22.0, 16.0), 55)
    plan.walls()
    mount, good = here.compose(seen.mount), np.isfinite(seen.ranges)
    ends = [
        (mount.x + r * math.cos(mount.yaw + a), mount.y + r * math.sin(mount.yaw + a))
        for r, a in zip(seen.ranges[good].tolist(), seen.angles[good].tolist(), strict=True)
    ]
    plan.dots(ends, RED)
    plan.dots([(pose.x, pose.y) for floor, pose in fleet.world.truth.people if floor == 0], GOLD, 9)
    plan.robot(here, BLUE)
    plan.legend((RED, "what the lidar says"), (GOLD, "people"), (BLUE, "the robot"), (WALL, "the world"))
    plan.save(folder / "sim-scan.png")


async def mapped(fleet: Fleet, clock: LockstepClock, folder: Path) -> None:
    """The map after a tour: what was measured, what odometry and localization believed, and the truth."""
    robot, start = fleet.robots["a"], fleet.world.truth.pose_of("a")
    tracks: dict[str, list[Spot]] = {"truth": [], "odometry": [], "believed": []}

    def watch() -> None:
        for name, pose in (
            ("truth", fleet.world.truth.pose_of("a")),
            ("odometry", start.compose(robot[Odometry].reading.pose)),
            ("believed", start.compose(robot[Localization].pose)),
        ):
            tracks[name].append((pose.x, pose.y))

    for goal in ((8.0, 10.0), (14.0, 10.0), (20.0, 10.0), (25.0, 10.0), (10.0, 10.0), (3.0, 10.0), (18.0, 10.0)):
        spot = Pose(*goal).relative_to(start).point
        await until_done(clock, robot[Navigation].navigate_to([spot], NavigationOptions(tolerance=0.4)), watch)
    plan, grid = Plan(fleet, (0.0, 0.0), (30.0, 20.0), 36), robot[Mapping].grid
    rows, columns = np.nonzero(grid.log_odds)
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        x = grid.origin.x + (column + 0.5) * grid.resolution
        y = grid.origin.y + (row + 0.5) * grid.resolution
        spot_in_world = start.compose(Pose(x, y))
        px, py = plan.at(spot_in_world.x, spot_in_world.y)
        if 0 <= px < plan.image.width and 0 <= py < plan.image.height:
            plan.pen.rectangle((px - 1, py - 1, px + 1, py + 1), fill=INK if grid.log_odds[row, column] > 0 else FREE)
    plan.walls(fill=None, outline="#c9a1a8")
    plan.line(tracks["odometry"], GOLD)
    plan.line(tracks["truth"], BLUE, 5)
    plan.line(tracks["believed"], RED, 2)
    entries = ((INK, "mapped"), (GOLD, "odometry"), (RED, "localization"), (BLUE, "truth"), ("#c9a1a8", "the world"))
    plan.legend(*entries)
    plan.save(folder / "sim-map.png")


async def sights(fleet: Fleet, clock: LockstepClock, folder: Path) -> None:
    """A picture, and the detectors' results on it."""
    robot, kinds = fleet.robots["a"], {"people": RED, "markers": BLUE, "tags": GREEN, "gestures": GOLD}
    fleet.world.stage.place("a", Pose(2.2, 3.4, math.radians(16)))
    viewers = {kind: getattr(robot[Vision], kind).subscribe() for kind in kinds}
    await clock.advance(1.5)
    frame = await robot[Camera].capture()
    image = Image.fromarray(frame.rgb())
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(22)
    for kind, viewer in viewers.items():
        for item in viewer.drain()[-1].seen:
            box = item.box
            left, top = (box.x - box.width / 2) * 1280, (box.y - box.height / 2) * 720
            pen.rectangle((left, top, left + box.width * 1280, top + box.height * 720), outline=kinds[kind], width=3)
            name = getattr(item, "symbol", getattr(item, "text", getattr(item, "gesture", "person")))
            pen.text((left + 4, max(0.0, top - 26)), str(name), fill=kinds[kind], font=font)
        viewer.close()
    store(image.resize((960, 540)), folder / "sim-sights.png")


async def shelf(fleet: Fleet, clock: LockstepClock, folder: Path) -> None:
    """A way under a shelf, by its legs."""
    robot, start, track = fleet.robots["a"], fleet.world.truth.pose_of("a"), list[Spot]()

    def watch() -> None:
        track.append((fleet.world.truth.pose_of("a").x, fleet.world.truth.pose_of("a").y))

    await clock.advance(1.0)
    (stand,) = fleet.world.building.shelves
    goal = MarkGoal(mark=Mark.SHELF, start=Pose(5.4, 6.4, -0.1).relative_to(start), lift=True)
    docking, seen = robot[TagDocking].dock_at(goal), None
    while docking.feedback != "docking" and not docking.status.ended:
        await clock.advance(0.1)
        watch()
        seen = robot[Lidar].scan
        here = fleet.world.truth.pose_of("a")
    await until_done(clock, docking, watch)
    plan = Plan(fleet, (2.2, 4.2), (9.2, 8.0), 140)
    plan.walls()
    assert seen is not None
    mount, good = here.compose(seen.mount), np.isfinite(seen.ranges)
    ends = [
        (mount.x + r * math.cos(mount.yaw + a), mount.y + r * math.sin(mount.yaw + a))
        for r, a in zip(seen.ranges[good].tolist(), seen.angles[good].tolist(), strict=True)
    ]
    board = [stand.pose.compose(Pose(x, y)) for x, y in ((0.45, 0.45), (-0.45, 0.45), (-0.45, -0.45), (0.45, -0.45))]
    plan.pen.polygon([plan.at(corner.x, corner.y) for corner in board], outline=INK, fill="#f3ead8")
    plan.dots(ends, RED, 3)
    plan.line(track, BLUE, 4)
    plan.robot(fleet.world.truth.pose_of("a"), BLUE)
    plan.legend((RED, "the scan that its legs were found in"), (BLUE, "the robot's way"), ("#f3ead8", "the shelf"))
    plan.save(folder / "sim-shelf.png")


PICTURES = (
    ("office", "universal", scan),
    ("office", "universal", mapped),
    ("playground", "universal", sights),
    (str(ROOT / "tests/autonomy/worlds/marks.toml"), "hermes", shelf),
)


async def main(folder: Path) -> None:
    for world, body, draw in PICTURES:
        clock, database = LockstepClock(), Database(":memory:")
        fleet = build_fleet(world, [RobotConfig("a", body=body)], clock=clock, seed=3, database=database)
        await fleet.start(wait=True)
        await draw(fleet, clock, folder)
        await fleet.close()
        database.close()


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"))
