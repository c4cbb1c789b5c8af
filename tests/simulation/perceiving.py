"""A room with what a test puts into it and robots that look at it, on a lockstep clock."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec

from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.geometry import Pose
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.description_checks import completed
from roboglot.simulation.world.world import RobotPlacement
from tests.simulation.conftest import Simulation

START = Pose(2, 5)
EYE = (0.25, 0.37, 0.05, 1.2217, 16 / 9)  # the universal body's: ahead, above the floor, up, fov, aspect


class Lab(Simulation):
    """A simulation whose robots are asked what they perceive."""

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
    """Yield a square room; ``floor`` is the rest of the lowest floor's description."""
    storeys = [{"size": [size, size], **floor}, *({"size": [size, size]} for _ in range(floors - 1))]
    description = completed(msgspec.convert({"floors": storeys}, WorldDescription), "test")
    placements = [RobotPlacement(n, body, start=start if n == "a" else None) for n in robots]
    room = Lab.of(description, placements, seed)
    room.world.start()
    yield room
    room.world.close()


def appears(x: float, y: float, z: float, robot: Pose = START) -> tuple[float, float]:
    """Return where the universal body's picture shows a place of the world, worked out once more by hand."""
    ahead, above, up, fov, aspect = EYE
    seen = Pose(x, y).relative_to(robot)
    forward, rise = seen.x - ahead, z - above
    depth = forward * math.cos(up) + rise * math.sin(up)
    over = rise * math.cos(up) - forward * math.sin(up)
    wide = 2 * math.tan(fov / 2)
    return 0.5 - seen.y / depth / wide, 0.5 - over / depth / wide * aspect
