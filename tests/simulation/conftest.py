"""A world with robots on a lockstep clock, without autonomy: only the simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Self

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world


@dataclass
class Simulation:
    """The world, its clock and the first robot."""

    world: World
    clock: LockstepClock
    robots: dict[str, Robot]

    @property
    def robot(self) -> Robot:
        return self.robots["a"]

    @property
    def pose(self) -> Pose:
        return self.world.truth.pose_of("a")

    @classmethod
    def of(
        cls, description: WorldDescription, placements: list[RobotPlacement], seed: int, *, compiled: bool = True
    ) -> Self:
        """Build a world with its robots, and the kernels that a fleet waits for; it is not started.

        Without these (``compiled``) a second takes five times as long.
        """
        clock = LockstepClock()
        world = World(description, placements, clock=clock, seed=seed)
        robots = {name: Robot(name, world.description_of(name), clock) for name in [p.name for p in placements]}
        for robot in robots.values():
            world.equip(robot)
        if compiled:
            world._use_kernels()
        return cls(world, clock, robots)


Simulate = Callable[..., Simulation]


@pytest.fixture
def simulate() -> Iterator[Simulate]:
    """``simulate("empty", start=Pose(...), seed=1, robots=("a", "b"), body="hermes")``."""
    opened: list[World] = []

    def build(
        name: str | WorldDescription = "empty",
        *,
        start: Pose | None = None,
        floor: int = 0,
        seed: int = 1,
        robots: tuple[str, ...] = ("a",),
        body: str = "universal",
        compiled: bool = True,
    ) -> Simulation:
        placements = [RobotPlacement(n, body, start=start if n == "a" else None, floor=floor) for n in robots]
        built = Simulation.of(load_world(name) if isinstance(name, str) else name, placements, seed, compiled=compiled)
        opened.append(built.world)
        return built

    yield build
    for world in opened:
        world.close()
