"""Lines of sight agree with MuJoCo's rays, which know nothing of how they are worked out here."""

import msgspec
import numpy as np
import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.geometry import Pose
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world


def deserted(name):
    """A shipped world without its people: theirs are capsules in the physics."""
    world = load_world(name)
    floors = tuple(msgspec.structs.replace(floor, people=(), gadgets=()) for floor in world.floors)
    return msgspec.structs.replace(world, floors=floors)


@pytest.mark.parametrize(("name", "size"), [("office", (30, 20)), ("playground", (8, 8))])
async def test_as_many_rays_as_you_like(name, size):
    clock = LockstepClock()
    world = World(deserted(name), [RobotPlacement("a"), RobotPlacement("b")], clock=clock)
    world.stage.add_obstacle(Pose(size[0] / 2, 2.0, 0.7), (0.6, 0.3, 0.9))
    world.start()
    await clock.advance(0.1)  # otherwise the physics does not know yet where things are
    random = np.random.default_rng(3)
    hull, lines, rays = world._population.hull("a"), world._environment.surroundings.lines, world._physics.rays
    differing = clear = 0
    for _ in range(60):
        eye = np.array((*random.uniform(0.3, size), random.uniform(0.1, 1.0)))
        places = np.column_stack((random.uniform(0.0, size, (40, 2)), random.uniform(0.05, 2.0, 40)))
        ways = places - eye
        lengths = np.linalg.norm(ways, axis=1)
        away = rays.cast(eye[None], ways / lengths[:, None], 50.0, hull)
        free = away >= lengths - 0.02
        mine = lines.now(0).clear(eye, places, (hull,))
        if not mine.any():
            continue  # within a solid: MuJoCo sees its other side
        differing += int(np.count_nonzero(free != mine))
        clear += int(np.count_nonzero(mine))
    world.close()
    assert clear > 100
    assert differing <= 12  # of some 2000: within solids, and along edges
