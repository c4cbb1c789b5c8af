"""ROS maps become worlds: free stays free, walls stay walls, bad files are named."""

import os
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.building.blueprint import SolidKind, solids_of
from roboglot.simulation.world.declarations import BadFile
from roboglot.simulation.world.world_files import load_world, read_ros_grid

MAP = "image: {image}\nresolution: 0.1\norigin: [{x}, -2.0, {yaw}]\noccupied_thresh: 0.65\nfree_thresh: 0.25\n{more}"
TAGGED = ("!!int ''", "!!bool maybe", "!!timestamp soon", "!!float ''")  # each another error of the library's own


@pytest.fixture
def write(tmp_path):
    """A ROS map file of these pixels (row 0 on top)."""

    def make(pixels, *, x=0.0, yaw=0.0, more="negate: 0\n", image="map.pgm"):
        Image.fromarray(np.asarray(pixels, np.uint8)).save(tmp_path / "map.pgm")
        path = tmp_path / "map.yaml"
        path.write_text(MAP.format(image=image, x=x, yaw=yaw, more=more))
        return path

    return make


def room(rows=60, columns=80):
    pixels = np.full((rows, columns), 254)
    pixels[[0, -1]] = pixels[:, [0, -1]] = 0
    return pixels


@pytest.mark.parametrize("name", ["depot", "tb3_sandbox"])
async def test_occupied_cells_and_only_they_are_solid(simulate, request, name):
    folder = request.config.rootpath / "tests/data/maps"
    world = load_world(folder / f"{name}.yaml")
    floor = world.floors[0]
    pixels = np.asarray(Image.open(folder / f"{name}.pgm").convert("L"))[::-1]
    covered = np.zeros(pixels.shape, int)
    for solid in solids_of(floor, None, False):
        if solid.kind is SolidKind.DOCK:
            continue
        half = np.array(solid.size[:2]) / 2
        if abs(np.sin(solid.pose.yaw)) > 0.5:
            half = half[::-1]
        low = (np.array((solid.pose.x, solid.pose.y)) - half - floor.origin) / 0.05
        high = (np.array((solid.pose.x, solid.pose.y)) + half - floor.origin) / 0.05
        (c0, r0), (c1, r1) = np.rint(low).astype(int), np.rint(high).astype(int)
        covered[max(0, r0) : max(0, r1), max(0, c0) : max(0, c1)] += 1
    assert ((255 - pixels.astype(int)) / 255 > 0.65).astype(int).tolist() == covered.tolist()


@pytest.mark.parametrize("name", ["depot", "tb3_sandbox"])
async def test_a_robot_lives_in_it(simulate, request, name):
    sim = simulate(str(request.config.rootpath / f"tests/data/maps/{name}.yaml"))
    sim.world.start()
    await sim.clock.advance(0.2)
    assert sim.robot[DockContact].docked
    start = sim.pose
    sim.robot[Base].set_velocity(Twist(0.3))
    await sim.clock.advance(2.0)
    assert sim.pose.distance_to(start) > 0.45
    assert np.isfinite(sim.robot[Lidar].scan.ranges).sum() > 100


async def test_walls_stand_where_the_map_has_them(simulate, write):
    path = write(room(), x=-3.0)
    sim = simulate(str(path))
    sim.world.start()
    sim.world.stage.place("a", Pose(2.0, 1.5))
    await sim.clock.advance(0.2)
    ranges = sim.robot[Lidar].scan.ranges
    # 80 x 60 cells of 0.1 m from (-3, -2), the outermost ones walls
    assert ranges[180] == pytest.approx(4.9 - 2.0, abs=0.05)
    assert ranges[270] == pytest.approx(3.9 - 1.5, abs=0.05)
    assert ranges[90] == pytest.approx(1.5 + 1.9, abs=0.05)


def test_rows_run_from_the_top(write):
    pixels = room()
    pixels[5:10, 40:50] = 0  # near the upper edge: high y
    things = [s for s in solids_of(load_world(write(pixels)).floors[0], None, False) if s.size[0] == pytest.approx(1.0)]
    assert [(round(s.pose.x, 3), round(s.pose.y, 3)) for s in things] == [(4.5, 3.25)]


def test_negate_and_modes(write):
    def solid(path):
        return sum(s.size[0] * s.size[1] for s in solids_of(load_world(path).floors[0], None, False) if s.pose.x > 0.3)

    pixels = room()
    pixels[20:30, 60:70] = 0
    expected = solid(write(pixels))
    assert solid(write(255 - pixels, more="negate: 1\n")) == pytest.approx(expected)
    assert solid(write(pixels, more="mode: scale\n")) == pytest.approx(expected)
    raw = np.where(pixels == 0, 100, 0)
    assert solid(write(raw, more="mode: raw\n")) == pytest.approx(expected)


def test_grey_is_neither_wall_nor_place_for_dock(write):
    pixels = room()
    pixels[:, :40] = 128
    world = load_world(write(pixels))
    assert world.floors[0].docks[0].at[0] > 4.0
    assert not [s for s in solids_of(world.floors[0], None, False) if 0.2 < s.pose.x < 3.9 and s.size[1] > 0.2]


@pytest.mark.parametrize("image", ["deep.png", "deep.tiff", "deep.pgm"])
def test_sixteen_bits_are_grey_as_eight_are(write, tmp_path, image):
    pixels = room()
    pixels[20:30, 20:30] = 128
    wanted = load_world(write(pixels))
    deep = np.asarray(pixels, np.uint16) * 257
    if image.endswith(".pgm"):
        (tmp_path / image).write_bytes(b"P5 80 60 65535\n" + deep.byteswap().tobytes())
    else:
        Image.fromarray(deep).save(tmp_path / image)
    assert load_world(write(pixels, image=image)) == wanted
    known = read_ros_grid(write(pixels, image=image)).log_odds
    assert not known[60 - 30 : 60 - 20, 20:30].any(), "grey is unknown"


def test_pixels_that_are_fractions_are_refused(write, tmp_path):
    Image.fromarray(np.asarray(room(), np.float32)).save(tmp_path / "real.tiff")
    with pytest.raises(BadFile, match="pixels are fractions"):
        load_world(write(room(), image="real.tiff"))


def test_the_same_map_gives_the_same_world(write):
    path = write(room())
    assert load_world(path) == load_world(path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"yaw": 0.5}, "only maps with yaw 0"),
        ({"more": "mode: colourful\n"}, "not a ROS map"),
        ({"image": "gone.pgm"}, "gone.pgm: No such file"),
        ({"image": "map.yaml"}, "not an image"),
        ({"more": "negate: [\n"}, "not YAML"),
        *(({"more": f"negate: {word}\n"}, "not YAML: a value does not fit its tag") for word in TAGGED),
    ],
)
def test_bad_maps_are_named(write, options, message):
    with pytest.raises(BadFile, match=message):
        load_world(write(room(), **options))


def test_maps_without_room_are_refused(write):
    with pytest.raises(BadFile, match="no free cell"):
        load_world(write(np.zeros((20, 20))))
    with pytest.raises(BadFile, match="nowhere"):
        load_world(write(room(8, 8)))


def test_noise_does_not_become_a_million_boxes(write):
    speckles = np.random.default_rng(1).choice([0, 254], (200, 200))
    with pytest.raises(BadFile, match="clean the map"):
        load_world(write(speckles))


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\n%%EOF\n", "not an image"),  # not run
        (b"P5\n9 9\n0\n" + bytes(81), "maxval"),
        (b"P2\n9 9\n255\n" + b"9" * 99, "Token too long"),
        (b"P5\n99999 99999\n255\n", "pixels"),
        (b"P5\n9999 9999\n255\n", "more than 16000000"),  # of which the library would print a warning
        (None, "not a file"),
    ],
)
def test_hostile_images_are_refused(write, tmp_path, image, message):
    path = write(room(), image="hostile.pgm")
    if image is None:
        os.mkfifo(tmp_path / "hostile.pgm")
    else:
        (tmp_path / "hostile.pgm").write_bytes(image)
    with pytest.raises(BadFile, match=message):
        load_world(path)


def test_images_that_need_all_memory_are_refused(write, monkeypatch):
    path = write(room())
    monkeypatch.setattr(Image.Image, "convert", Mock(side_effect=MemoryError))
    with pytest.raises(BadFile, match="more memory"):
        load_world(path)
