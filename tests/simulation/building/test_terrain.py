"""The shape of uneven ground, and what is wrong with bad descriptions of it."""

import math

import pytest

from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.geometry import Pose
from roboglot.simulation.building.terrain import Ground, pieces_of, slices_of
from roboglot.simulation.world.declarations import BadFile
from roboglot.simulation.world.description import Floor, Terrain, WorldDescription
from roboglot.simulation.world.world_files import load_world

RAMP = Terrain(at=(2.0, 1.0), profile=((0, 0), (1, 0.2), (2, 0.2)), width=1.0, facing=90.0)


def ground(*terrain):
    return Ground(WorldDescription(floors=(Floor(size=(9, 9), terrain=terrain),)))


@pytest.mark.parametrize(
    ("x", "y", "height"),
    [(2.0, 1.5, 0.1), (2.4, 1.75, 0.15), (2.0, 2.5, 0.2), (2.6, 1.5, 0.0), (2.0, 0.9, 0.0), (2.0, 3.1, 0.0)],
)
def test_heights(x, y, height):
    assert ground(RAMP).height(x, y, 0) == pytest.approx(height)


def test_the_highest_counts_where_pieces_overlap():
    step = Terrain(at=(2.0, 1.0), profile=((0, 0.15), (1, 0.15)), facing=90.0)
    assert ground(RAMP, step).height(2.0, 1.25, 0) == pytest.approx(0.15)
    assert ground(RAMP, step).height(2.0, 1.9, 0) == pytest.approx(0.18)


def test_grip_where_it_is_described():
    ice = Terrain(at=(5.0, 5.0), profile=((0, 0), (1, 0)), grip=0.1)
    assert ground(ice).grip(5.5, 5.2, 0) == 0.1
    assert ground(ice).grip(4.9, 5.2, 0) == 1.0
    assert ground(ice).height(5.5, 5.2, 0) == 0.0
    assert not list(pieces_of(ice))


def test_pieces_have_the_surface_as_their_upper_side():
    slope, platform = pieces_of(RAMP)
    assert {(round(x, 6), round(y, 6), z) for x, y, z in slope if z >= 0} == {
        (2.5, 1.0, 0.0),
        (1.5, 1.0, 0.0),
        (2.5, 2.0, 0.2),
        (1.5, 2.0, 0.2),
    }
    assert len(platform) == 8


def test_slices_begin_where_the_slope_is_that_high():
    (lower, upper) = slices_of(RAMP, 0.1)
    middle, length, width = lower
    assert (middle.x, middle.y, length, width) == (pytest.approx(2.0), pytest.approx(1.75), pytest.approx(0.5), 1.0)
    assert upper[1] == pytest.approx(1.0)
    assert not list(slices_of(RAMP, 0.2))


def test_level_worlds_are_not_uneven():
    assert not ground().uneven
    assert ground(RAMP).uneven
    assert math.isclose(RAMP.facing, 90.0)


async def test_lidar_sees_only_what_rises_above_its_plane(simulate):
    sim = simulate("obstacle_course", start=Pose(2.0, 4.0))
    sim.world.start()
    await sim.clock.advance(0.2)
    ahead = 180
    edge = 3.0 + 1.5 * 0.35 / 0.4  # where the slope is as high as the lidar's plane
    assert sim.robot[Lidar].scan.ranges[ahead] == pytest.approx(edge - 2.0, abs=0.05)
    sim.world.stage.place("a", Pose(5.2, 4.0))
    await sim.clock.advance(0.5)
    assert sim.world.truth.height_of("a") == pytest.approx(0.4, abs=0.002)
    assert sim.robot[Lidar].scan.ranges[ahead] == pytest.approx(12.0 - 5.2, abs=0.05)  # over all of it


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("terrain = [{ at = [1, 1], profile = [[0, 0]] }]", "must have at least 2 entries"),
        ("terrain = [{ at = [1, 1], profile = [[0, 0], [0, 0.1]] }]", r"terrain\[0\].profile must go on"),
        ("terrain = [{ at = [19, 1], profile = [[0, 0], [1, 1]] }]", r"terrain\[0\].at = .* outside the floor"),
        ('things = [{ name = "a", at = [1, 1] }, { name = "a", at = [2, 1] }]', "two things have the name a"),
        ('things = [{ name = "a", at = [1, 1], mass = 900 }]', "mass"),
    ],
)
def test_bad_descriptions_are_reported(tmp_path, line, message):
    path = tmp_path / "world.toml"
    path.write_text(f"[[floors]]\nsize = [9, 9]\n{line}\n")
    with pytest.raises(BadFile, match=message):
        load_world(str(path))
