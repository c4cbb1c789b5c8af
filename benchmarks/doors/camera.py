"""Claims: a 720p picture of the office is drawn in <= 5 ms; camera and H.264 at 720p30 take <= 0.25 of a core.

``--pictures FOLDER`` also writes what was drawn as PNG.
"""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path

from _claim import Claims

from roboglot.media.video import VideoStream
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.rendering.figures import posing
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

SECONDS = 10.0
PICTURE_LIMIT = 5.0  # ms
SHARE_LIMIT = 0.25  # of a core
VIEWS = {
    "corridor": Pose(21.5, 9.6, 3.14),
    "reception": Pose(7.0, 7.5, -2.2),
    "open-plan office": Pose(12.0, 12.2, 1.7),
    "meeting room": Pose(16.0, 7.6, -0.7),
}


def place(clock: LockstepClock | RealClock) -> tuple[World, Robot]:
    """Return the office with one robot."""
    world = World(load_world("office"), [RobotPlacement("a")], clock=clock)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    return world, robot


async def draw(claims: Claims, folder: Path | None) -> None:
    """Time single pictures with their scene: the best of many, as other work can only add time."""
    world, robot = place(LockstepClock())
    camera = robot[Camera]
    await camera.capture()  # loads the kernels
    for name, pose in VIEWS.items():
        times = []
        for turn in range(60):
            world.stage.place("a", Pose(pose.x, pose.y, pose.yaw + 0.0001 * turn))  # an unchanged view is not drawn
            posing.cache_clear()  # as if all people were walking
            began = time.thread_time()  # lockstep draws in the calling thread
            frame = await camera.capture()
            times.append(1e3 * (time.thread_time() - began))
        claims.at_most(f"{name} (median {sorted(times)[30]:.2f})", min(times), PICTURE_LIMIT, "ms")
        if folder:
            from PIL import Image

            Image.fromarray(frame.rgb()).save(folder / f"{name}.png")
    world.close()


async def stream(claims: Claims) -> None:
    """Measure the share of a core that live video takes while the robot turns, without that of the world itself."""
    world, robot = place(RealClock())
    world.stage.place("a", VIEWS["open-plan office"])
    world.start()
    await robot[Camera].capture()
    alone, _, _ = await watched(world, robot, 0)
    print(f"the world alone: {alone:.2f} core")
    for viewers in (1, 4):
        share, pictures, bits = await watched(world, robot, viewers)
        print(f"{pictures:.1f} pictures/s, {1e-6 * bits:.1f} Mbit/s for ", end="")
        claims.at_most(f"{viewers} viewers", share - alone, SHARE_LIMIT, "core")
    world.close()


async def watched(world: World, robot: Robot, viewers: int) -> tuple[float, float, float]:
    """Return the share of a core, and pictures and bits a second of one viewer."""
    video = VideoStream(robot[Camera], robot.clock)
    watching = [video.subscribe() for _ in range(viewers)]
    await asyncio.sleep(1.0)
    for viewer in watching:
        viewer.drain()
    packets, size, used, began = 0, 0, time.process_time(), time.monotonic()
    while (passed := time.monotonic() - began) < SECONDS:
        world.stage.place("a", Pose(12.0, 14.0, 1.7 + 0.5 * passed))
        await asyncio.sleep(1 / 60)  # a new view for each picture
        for got in [viewer.drain() for viewer in watching][:1]:
            packets += len(got)
            size += sum(len(packet.data) for packet in got)
    used = time.process_time() - used
    for viewer in watching:
        viewer.close()
    return used / passed, packets / passed, 8 * size / passed


def main() -> None:
    folder = Path(sys.argv[2]) if sys.argv[1:2] == ["--pictures"] else None
    claims = Claims()
    asyncio.run(draw(claims, folder))
    asyncio.run(stream(claims))
    claims.finish()


if __name__ == "__main__":
    main()
