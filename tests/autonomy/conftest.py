"""Map and world side by side: goals are given in the world, because the truth is there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from roboglot.model.actions import Action
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.events import BumperPressed, PathBlocked
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World


@dataclass
class Tour:
    """Drives robot "a" about and knows where it really is."""

    robot: Robot
    world: World
    clock: LockstepClock
    start: Pose
    bumps: list[BumperPressed] = field(default_factory=list)
    blocks: list[PathBlocked] = field(default_factory=list)

    @property
    def truth(self) -> Pose:
        return self.world.truth.pose_of("a")

    @property
    def error(self) -> tuple[float, float]:
        """Distance of localization from the truth: m, degrees."""
        pose = self.start.compose(self.robot[Localization].pose)
        return pose.distance_to(self.truth), abs(math.degrees(wrap_angle(pose.yaw - self.truth.yaw)))

    def on_map(self, x: float, y: float) -> Point:
        return Pose(x, y).relative_to(self.start).point

    def head_for(self, *spots: tuple[float, float], deg: float | None = None, **options: Any) -> Action:
        """Navigate to spots and heading of the world."""
        yaw = None if deg is None else wrap_angle(math.radians(deg) - self.start.yaw)
        goals = [self.on_map(*spot) for spot in spots]
        return self.robot[Navigation].navigate_to(goals, NavigationOptions(yaw=yaw, **options), source="test")

    def robot_finds_itself(self) -> Action:
        """Return the action by which a robot finds itself after it was carried elsewhere."""
        return self.robot[Localization].relocalize()

    async def until(self, condition: Callable[[], object], seconds: float = 120.0) -> None:
        """Let time pass until something is so."""
        end = self.clock.time() + seconds
        while not condition():
            assert self.clock.time() < end, f"not within {seconds} s"
            await self.clock.advance(0.1)

    async def end_of(self, action: Action, seconds: float = 120.0) -> Action:
        await self.until(lambda: action.status.ended, seconds)
        return action

    async def go(self, *spots: tuple[float, float], deg: float | None = None, **options: Any) -> Action:
        return await self.end_of(self.head_for(*spots, deg=deg, **options))


@pytest.fixture
async def tour(robot: Robot, world: World, clock: LockstepClock) -> Tour:
    """The robot on its dock, half a second after it woke up."""
    made = Tour(robot, world, clock, world.truth.pose_of("a"))
    robot.events.listen(BumperPressed, made.bumps.append)
    robot.events.listen(PathBlocked, made.blocks.append)
    await clock.advance(0.5)
    return made
