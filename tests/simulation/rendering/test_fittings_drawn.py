"""Cameras see robots' gimbals, arms and lamps, beads in the air, and the lift's car from inside."""

import numpy as np
import pytest

from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.light import Colour, Light
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.geometry import Pose

RED = Colour(255, 0, 0)


async def picture(sim):
    return (await sim.robot[Camera].capture()).rgb().astype(int)


def red(image):
    return int(((image[..., 0] > 150) & (image[..., 1:].max(axis=-1) < 90)).sum())


@pytest.fixture
def facing(simulate):
    """Robot a looks at an EP that looks back, a metre away."""
    sim = simulate(robots=("a", "b"), body="robomaster_ep")
    sim.world.start()
    sim.world.stage.place("a", Pose(3.0, 5.0))
    sim.world.stage.place("b", Pose(4.0, 5.05, np.pi))
    return sim


async def test_lamps_shine(facing):
    await facing.clock.advance(0.2)
    dark = await picture(facing)
    facing.robots["b"][Light].shine("front", RED)
    await facing.clock.advance(0.1)
    assert red(await picture(facing)) > red(dark) + 100


async def test_a_gimbal_turns(facing):
    facing.robots["b"][Gimbal].set_mode(FollowMode.FREE)
    await facing.clock.advance(0.5)
    before = await picture(facing)
    facing.robots["b"][Gimbal].move_to(yaw=1.2)
    await facing.clock.advance(2.0)
    assert (np.abs(await picture(facing) - before).max(axis=-1) > 40).sum() > 300


@pytest.mark.slow
async def test_beads_fly_through_the_picture(facing):
    facing.world.stage.place("b", Pose(6.0, 5.0, np.pi / 2))
    facing.world.stage.place("a", Pose(4.0, 5.3, 0.0))
    await facing.clock.advance(0.5)
    before = await picture(facing)
    facing.robots["b"][Blaster].fire()
    seen = 0
    for _ in range(10):
        await facing.clock.advance(0.02)
        seen = max(seen, int((np.abs(await picture(facing) - before).max(axis=-1) > 40).sum()))
    assert seen > 0


async def test_the_car_is_seen_from_inside(simulate):
    sim = simulate("office", robots=("a",))
    sim.world.start()
    lift = sim.world.building.lift
    sim.world.stage.place("a", lift.frame.compose(Pose(0.3, 0.0, np.pi)))
    await sim.clock.advance(0.5)
    image = await picture(sim)
    row = image[200, 640]
    assert row.max() - row.min() < 12  # its grey panel, not the corridor's coloured plaster
    assert 90 < row.mean() < 215
