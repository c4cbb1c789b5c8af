"""A world of robots that stand, or drive circles, in lockstep: what several benchmarks measure."""

from __future__ import annotations

import gc
from dataclasses import dataclass

from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Collided
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

AHEAD, CIRCLE = Twist(0.15, 0.0, 0.0), Twist(0.12, 0.0, 1.0)  # leave docks, then turn where there is room


@dataclass
class Crowd:
    """Started robots without autonomy in the office; ``scans``: number of scans of all robots."""

    clock: LockstepClock
    world: World
    robots: list[Robot]
    scans: int = 0

    @property
    def ways(self) -> list[float]:
        """Metres that each robot drove so far."""
        return [robot[Odometry].reading.distance for robot in self.robots]

    def count(self, _: ScanTaken) -> None:
        """Count a scan."""
        self.scans += 1


def drive(base: Base, twist: Twist) -> None:
    """Drive with this velocity, or backwards where the hull touches something ahead: crowds start close together."""
    try:
        base.set_velocity(twist)
    except Collided:
        base.set_velocity(Twist(-twist.x, 0.0, twist.yaw))


async def crowd(count: int, body: str, seed: int, *, driving: bool) -> Crowd:
    """Return ``count`` robots of a body, which drive circles from now on or stand."""
    clock = LockstepClock()
    names = [f"r{index}" for index in range(count)]
    world = World(load_world("office"), [RobotPlacement(name, body) for name in names], clock=clock, seed=seed)
    robots = [Robot(name, world.description_of(name), clock) for name in names]
    made = Crowd(clock, world, robots)
    for robot in robots:
        world.equip(robot)
        robot.events.listen(ScanTaken, made.count)
    await world.prepare(wait=True)
    world.start()
    await clock.advance(0.5)
    gc.freeze()  # as the runtime does
    for twist in (AHEAD, CIRCLE) if driving else ():
        for robot in robots:
            drive(robot[Base], twist)
        await clock.advance(1.0)
    made.scans = 0
    return made
