"""Prints a digest of everything the robots of a lockstep world sense; run as a program by test_world_trace.py."""

import asyncio
import hashlib
import struct
import sys

from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.system.network import Network
from roboglot.model.events import BumperPressed, LiftArrived, ScanTaken
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world
from tests.narrowing import known


async def trace(seed: int, seconds: int) -> list[str]:
    """Digests, one a second, of three robots that drive, collide, lie down, get lost, call the lift, among people."""
    clock, digest = LockstepClock(), hashlib.sha256()
    world = World(
        load_world("office"),
        [RobotPlacement("a"), RobotPlacement("b"), RobotPlacement("c", "hermes")],
        clock=clock,
        seed=seed,
    )
    robots = {name: Robot(name, world.description_of(name), clock) for name in ("a", "b", "c")}

    def scanned(event: ScanTaken) -> None:
        digest.update(event.scan.ranges.tobytes() + struct.pack("4d", event.stamp, *pose(event.odometry)))

    for robot in robots.values():
        world.equip(robot)
        robot.events.listen(ScanTaken, scanned)
        robot.events.listen(LiftArrived, lambda event: digest.update(repr(event).encode()))
        robot.events.listen(BumperPressed, lambda event: digest.update(repr(event).encode()))
    world.start()
    robots["a"][Base].set_velocity(Twist(0.6, 0.1, 0.3))
    digests = list[str]()
    for second in range(seconds):
        await clock.advance(1.0)
        if second == 3:
            robots["b"][Legs].lie_down()
            world.stage.add_obstacle(world.truth.pose_of("a").compose(Pose(0.7, 0.3)))
            world.faults.inject("lost_localization", "c")
            robots["c"][LiftClient].call(1)
        if second == 8:
            digest.update(known(robots["c"][DepthCamera].image).points.tobytes())
        for name, robot in robots.items():
            digest.update(struct.pack("3d", *pose(world.truth.pose_of(name))))
            digest.update(repr((robot[Imu].reading, robot[Battery].state, robot[Network].signal)).encode())
        digests.append(digest.hexdigest())
    world.close()
    return digests


def pose(value: Pose) -> tuple[float, float, float]:
    return value.x, value.y, value.yaw


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        seed, seconds = map(int, argument.split(":"))
        print(*asyncio.run(trace(seed, seconds)))
