"""A room with what a test puts into it and robots that look at it, on a lockstep clock."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import msgspec

from roboglot.model.clock import LockstepClock
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.description_checks import completed
from roboglot.simulation.world.world import RobotPlacement, World

START = Pose(2, 5)
EYE = (0.25, 0.37, 0.05, 1.2217, 16 / 9)  # the universal body's: ahead, above the floor, up, fov, aspect


@dataclass
class Lab:
    """The world, its clock and robots."""

    world: World
    clock: LockstepClock
    robots: dict[str, Robot]

    @property
    def robot(self) -> Robot:
        return self.robots["a"]

    async def see(self, kind: str, seconds: float = 0.3, robot: str = "a") -> list[Any]:
        """Return a detector's last report after so long."""
        detector: Detector[Any] = getattr(self.robots[robot][Vision], kind)
        with detector.subscribe() as viewer:
            await self.clock.advance(seconds)
            return list(viewer.drain()[-1].seen)


@contextmanager
def lab(
    *, start: Pose = START, size: float = 10.0, robots: tuple[str, ...] = ("a",), body: str = "universal",
    seed: int = 1, floors: int = 1, **floor: Any,
) -> Iterator[Lab]:  # fmt: skip
    """A square room; ``floor`` is the rest of the lowest floor's description."""
    storeys = [{"size": [size, size], **floor}, *({"size": [size, size]} for _ in range(floors - 1))]
    description = completed(msgspec.convert({"floors": storeys}, WorldDescription), "test")
    clock = LockstepClock()
    placements = [RobotPlacement(n, body, start=start if n == "a" else None) for n in robots]
    world = World(description, placements, clock=clock, seed=seed)
    built = {n: Robot(n, world.description_of(n), clock) for n in robots}
    for robot in built.values():
        world.equip(robot)
    world.start()
    yield Lab(world, clock, built)
    world.close()


def appears(x: float, y: float, z: float, robot: Pose = START) -> tuple[float, float]:
    """Return where the universal body's picture shows a place of the world, worked out once more by hand."""
    ahead, above, up, fov, aspect = EYE
    seen = Pose(x, y).relative_to(robot)
    forward, rise = seen.x - ahead, z - above
    depth = forward * math.cos(up) + rise * math.sin(up)
    over = rise * math.cos(up) - forward * math.sin(up)
    wide = 2 * math.tan(fov / 2)
    return 0.5 - seen.y / depth / wide, 0.5 - over / depth / wide * aspect
