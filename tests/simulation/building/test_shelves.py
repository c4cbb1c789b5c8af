"""A carried shelf stops at what is in its way."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.building.blueprint import Solid, SolidKind
from roboglot.simulation.building.overlap import overlap

places, sizes = st.floats(-1.5, 1.5), st.floats(0.1, 2.0)
WORLD = """
name = "store"
[[floors]]
size = [8, 6]
furniture = [{ shape = "cylinder", at = [2.0, 4.4], radius = 0.1, height = 0.5 }]
shelves = [{ at = [4.0, 3.0], facing = 0 }]
"""


@pytest.fixture
async def carrier(simulate, tmp_path):
    """A robot with the shelf on its jack."""
    (tmp_path / "store.toml").write_text(WORLD)
    sim = simulate(str(tmp_path / "store.toml"), body="hermes", start=Pose(4.0, 3.0))
    sim.world.start()
    await sim.clock.advance(0.1)
    sim.robot[Jack].raise_platform()
    await sim.clock.advance(10.0)
    assert sim.robot[Jack].loaded
    return sim


@pytest.mark.slow
async def test_wall_stops_it_and_way_back_is_free(carrier):
    base, (shelf,) = carrier.robot[Base], carrier.world.building.shelves
    base.set_velocity(Twist(0.5))
    await carrier.clock.advance(8.0)
    assert carrier.pose.x == pytest.approx(8.0 - 0.45, abs=0.02)  # its front touches the wall
    assert shelf.pose.distance_to(carrier.pose) < 0.01
    base.set_velocity(Twist(yaw=0.5))
    await carrier.clock.advance(1.0)
    assert abs(carrier.pose.yaw) < 0.1  # a corner would enter the wall
    base.set_velocity(Twist(-0.5))
    await carrier.clock.advance(4.0)
    assert carrier.pose.x < 6.5


@pytest.mark.slow
async def test_low_thing_stops_leg_and_passes_between_legs(carrier):
    base = carrier.robot[Base]
    base.set_velocity(Twist(yaw=0.5))
    await carrier.clock.advance(math.pi)  # a quarter turn
    base.set_velocity(Twist(0.5))
    await carrier.clock.advance(6.0)
    assert carrier.pose.y == pytest.approx(6.0 - 0.45, abs=0.02)  # free up to the wall
    carrier.world.stage.place("a", Pose(2.43, 2.0, math.pi / 2))
    await carrier.clock.advance(0.1)
    base.set_velocity(Twist(0.5))
    await carrier.clock.advance(6.0)
    assert carrier.pose.y == pytest.approx(4.4 - 0.1 - 0.45, abs=0.02)  # a leg at the post


async def test_put_into_a_wall_it_can_leave_it(carrier):
    carrier.world.stage.place("a", Pose(7.7, 3.0))
    await carrier.clock.advance(0.5)
    assert carrier.pose.distance_to(Pose(7.7, 3.0)) < 0.01
    carrier.robot[Base].set_velocity(Twist(-0.5))
    await carrier.clock.advance(2.0)
    assert carrier.pose.x < 7.0


@given(places, places, st.floats(-3.2, 3.2), sizes, sizes, st.booleans())
def test_overlap_is_found_as_points_find_it(x, y, yaw, width, depth, round):
    """Compared with a raster of points, where it is not a matter of a hair."""
    size = (width, width if round else depth, 1.0)
    a, b = Solid(SolidKind.SHELF, Pose(), (1.0, 0.6, 1.0)), Solid(SolidKind.WALL, Pose(x, y, yaw), size, round=round)

    def inside(shrunk):
        for i in range(21):
            for j in range(21):
                at = Pose((i / 20 - 0.5) * (1.0 + shrunk), (j / 20 - 0.5) * (0.6 + shrunk)).relative_to(b.pose)
                if round and math.hypot(at.x, at.y) < width / 2 + shrunk:
                    return True
                if not round and abs(at.x) < width / 2 + shrunk and abs(at.y) < depth / 2 + shrunk:
                    return True
        return False

    assert overlap(a, b) == overlap(b, a)
    if inside(0.0):
        assert overlap(a, b)
    if not inside(0.1):
        assert not overlap(a, b)
    assert not overlap(a, Solid(SolidKind.WALL, b.pose, size, base=1.0, round=round))
