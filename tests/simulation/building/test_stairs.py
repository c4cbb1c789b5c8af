"""Flights of stairs: their shape, who stands before them, what the sensors make of them."""

import math

import numpy as np
import pytest

from roboglot.autonomy.navigation.driving import OdometryDriving
from roboglot.model.clock import LockstepClock
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.building.terrain import Ground
from roboglot.simulation.world.declarations import BadFile
from roboglot.simulation.world.description import Floor, Stairs, WorldDescription
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

FLIGHT = Stairs(at=(2.0, 1.0), steps=3, rise=0.15, run=0.3, width=1.0, facing=90.0, landing=0.5)


async def put(body, pose, world="stairs"):
    clock = LockstepClock()
    made = World(load_world(world), [RobotPlacement("a", body)], clock=clock, seed=1)
    robot = Robot("a", made.description_of("a"), clock)
    made.equip(robot)
    await made.prepare(wait=True)
    made.start()
    made.stage.place("a", pose)
    await clock.advance(0.5)
    return made, robot, clock


@pytest.mark.parametrize(
    ("x", "y", "height"),
    [(2.0, 0.99, 0.0), (2.0, 1.01, 0.15), (2.4, 1.29, 0.15), (2.0, 1.31, 0.3), (2.0, 1.61, 0.45), (2.0, 2.39, 0.45),
     (2.0, 2.41, 0.0), (2.51, 1.5, 0.0)],
)  # fmt: skip
def test_each_step_is_level_and_rises_sheer(x, y, height):
    ground = Ground(WorldDescription(floors=(Floor(size=(9, 9), stairs=(FLIGHT,)),)))
    assert ground.uneven
    assert ground.height(x, y, 0) == pytest.approx(height)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{ at = [9.0, 5.0], steps = 4 }", "leads outside the floor"),
        ("{ at = [11.0, 5.0], steps = 1, facing = 180 }", "lies outside the floor"),
        ("{ at = [5.0, 5.0], steps = 0 }", "steps"),
        ("{ at = [5.0, 5.0], steps = 400 }", "steps"),
        ("{ at = [5.0, 5.0], steps = 2, rise = 3 }", "rise"),
        ("{ at = [5.0, 5.0] }", "steps"),
    ],
)
def test_impossible_stairs_are_refused(entry, message, tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(f'name = "bad"\n[[floors]]\nsize = [10, 10]\nstairs = [{entry}]\n')
    with pytest.raises(BadFile, match=message):
        load_world(str(file))


async def test_lidar_sees_the_first_step_at_its_plane():
    world, robot, _ = await put("cyberdog2", Pose(3.0, 4.0))
    ranges = robot[Lidar].scan.ranges
    ahead = ranges[len(ranges) // 2]
    # 37 cm above the floor: the fourth step of 12 cm each, three times 30 cm behind the first.
    assert ahead == pytest.approx(1.0 + 0.9, abs=0.05)
    world.close()


async def test_the_eyes_see_riser_and_tread():
    world, robot, _ = await put("cyberdog2", Pose(3.5, 4.0))
    reading = robot[TimeOfFlight].reading("head left")
    x, _, z = reading.points.T
    riser, tread = (z > 0.03) & (z < 0.1), (x > 0.53) & (x < 0.75) & (z > 0.05)
    assert riser.any()
    assert x[riser] == pytest.approx(0.5, abs=0.03)
    assert tread.any()
    assert z[tread] == pytest.approx(0.12, abs=0.03)
    world.close()


@pytest.mark.parametrize("pose", [Pose(3.5, 4.0), Pose(5.4, 4.0, math.pi), Pose(2.0, 2.0)])
async def test_echoes_lie_on_rays_from_the_eye(pose):
    world, robot, _ = await put("cyberdog2", pose)
    for name in robot[TimeOfFlight].names:
        reading = robot[TimeOfFlight].reading(name)
        eye = np.array((reading.eye.x, reading.eye.y, reading.eye.z))
        assert np.linalg.norm(reading.rays, axis=1) == pytest.approx(1.0, abs=1e-5)
        ways = reading.distances.reshape(-1)
        seen = np.isfinite(ways)
        assert eye + reading.rays[seen] * ways[seen, None] == pytest.approx(reading.points, abs=1e-4)
        assert (eye[0] > 0) == name.startswith("head")
    world.close()


@pytest.mark.parametrize("body", ["universal", "cyberdog2"])
async def test_a_flight_stops_wheels_and_walks_alike(body):
    world, robot, clock = await put(body, Pose(3.0, 4.0))
    driving = OdometryDriving(robot)
    action = driving.move_by(Pose(2.0), speed=0.4)
    for _ in range(120):
        if action.status.ended:
            break
        await clock.advance(0.1)
    assert action.status.ended
    front = robot.description.radius
    assert world.truth.pose_of("a").x < 4.0 - 0.5 * front
    assert world._physics.hulls["a"].rise < 0.03
    world.close()


async def test_on_the_landing_it_stands_high_and_level():
    world, _, clock = await put("cyberdog2", Pose(5.8, 4.0))
    hull = world._physics.hulls["a"]
    assert hull.rise == pytest.approx(0.48, abs=0.005)
    await clock.advance(1.0)
    assert hull.tilt == pytest.approx((0.0, 0.0), abs=0.01)
    world.close()
