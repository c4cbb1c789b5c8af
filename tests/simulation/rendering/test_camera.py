"""Pictures of the camera, against geometry done by hand; it works only while someone looks."""

from __future__ import annotations

import asyncio
import math
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.sensing.camera import EXPOSURE_MAX, Camera
from roboglot.model.errors import Busy, InvalidGoal
from roboglot.model.feed import VIEWERS_MAX
from roboglot.model.geometry import Point, Pose, Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.description_checks import completed
from roboglot.simulation.world.world import RobotPlacement, World

START = Pose(2, 5)
SYMBOLS = ("1", "2", "3", "4", "7", "8", "0", "A", "B", "K", "heart")


def room(**things):
    """An empty room of 10 x 10 m."""
    return {"name": "room", "floors": [{"size": [10, 10], **things}]}


async def lab(world, *, start=START, clock=None, seed=1, others=(), body="universal"):
    """A running world with the robot "a", and that robot."""
    clock = clock or LockstepClock()
    description = completed(msgspec.convert(world, WorldDescription, strict=False), "test")
    placements = [
        RobotPlacement("a", body=body, start=start),
        *(RobotPlacement(f"r{i}", start=pose) for i, pose in enumerate(others)),
    ]
    built = World(description, placements, clock=clock, seed=seed)
    robots = []
    for placement in placements:
        robots.append(Robot(placement.name, built.description_of(placement.name), clock))
        built.equip(robots[-1])
    if isinstance(clock, LockstepClock):
        await built.prepare(wait=True)
    built.start()
    if isinstance(clock, LockstepClock):
        await clock.advance(0.2)
    return built, robots[0], clock


def pixel(robot, pose, x, y, z):
    """Return where a point of the world appears, by a pinhole's rules: column and row."""
    camera = robot[Camera]
    mount, focal = camera.mount, camera.width / 2 / math.tan(camera.fov / 2)
    dx, dy = x - pose.x, y - pose.y
    forward = math.cos(pose.yaw) * dx + math.sin(pose.yaw) * dy - mount.x
    left = -math.sin(pose.yaw) * dx + math.cos(pose.yaw) * dy
    up = z - mount.z
    c, s = math.cos(mount.pitch), math.sin(mount.pitch)
    ahead, down = c * forward - s * up, -(s * forward + c * up)
    return camera.width / 2 - focal * left / ahead, camera.height / 2 + focal * down / ahead


def reds(frame):
    """Return where a picture is decidedly red (half size)."""
    return frame.chroma[1] > 165


async def test_a_box_covers_the_pixels_that_geometry_says():
    closet = {"from": [0.5, 0], "to": [0.5, 10]}  # ours becomes the second room, which has a blue carpet
    world, robot, _ = await lab(room(walls=[closet]))
    world.stage.add_obstacle(Pose(4.25, 5.2), (0.5, 0.5, 0.6))
    pose = world.truth.pose_of("a")
    frame = await robot[Camera].capture()
    brown = frame.chroma[1].astype(int) - frame.chroma[0] > 20
    left, top = pixel(robot, pose, 4.0, 5.45, 0.6)
    right, bottom = pixel(robot, pose, 4.0, 4.95, 0.0)
    inside = np.zeros_like(brown)
    inside[round(top / 2) + 2 : round(bottom / 2) - 2, round(left / 2) + 2 : round(right / 2) - 2] = True
    assert brown[inside].all()
    rows, columns = np.nonzero(brown)
    front_top = pixel(robot, pose, 4.5, 5.45, 0.6)[1]  # its top's far edge is slightly higher in the picture
    foot_left = pixel(robot, pose, 4.0, 5.45, 0.0)[0]  # the camera looks up a little: edges lean
    assert columns.min() == pytest.approx(foot_left / 2, abs=1.5)
    assert columns.max() == pytest.approx(right / 2, abs=1.5)
    assert rows.max() == pytest.approx(bottom / 2, abs=2)
    assert rows.min() == pytest.approx(min(top, front_top) / 2, abs=2)
    world.close()


@pytest.mark.parametrize("distance", [1.5, 3.0, 6.0])
async def test_wall_ahead_meets_the_floor_where_geometry_says(distance):
    world, robot, _ = await lab(room(), start=Pose(10 - distance, 5))
    frame = await robot[Camera].capture()
    row = pixel(robot, world.truth.pose_of("a"), 10.0, 5.0, 0.0)[1]
    column = frame.luma[:, 640].astype(int)
    if row < 715:
        drop = column[round(row) + 4] - column[round(row) - 4]
        assert drop > 25  # from the floor up to the dark skirting board
        assert abs(int(np.argmax(np.abs(np.diff(column[round(row) - 12 : round(row) + 12]))) - 11)) <= 2
    world.close()


async def test_person_stands_where_geometry_says_behind_boxes_hidden():
    world, robot, _ = await lab(room(people=[{"path": [[6.0, 5.8]]}]))
    pose = world.truth.pose_of("a")
    shirt = reds(await robot[Camera].capture())
    rows, columns = np.nonzero(shirt)
    at = pixel(robot, pose, 6.0, 5.8, 1.2)
    assert 2 * columns.mean() == pytest.approx(at[0], abs=6)
    assert 2 * rows.min() >= pixel(robot, pose, 6.0, 5.8, 1.5)[1] - 4
    assert 2 * rows.max() <= pixel(robot, pose, 6.0, 5.8, 0.7)[1] + 4
    world.stage.add_obstacle(Pose(4.0, 5.4), (0.2, 1.6, 2.2))
    assert reds(await robot[Camera].capture()).sum() < 0.02 * shirt.sum()
    world.close()


async def test_another_robot_is_seen_and_oneself_is_not():
    world, robot, _ = await lab(room(), others=[Pose(4.5, 5, math.pi)])
    frame = await robot[Camera].capture()
    column, row = pixel(robot, world.truth.pose_of("a"), 4.25, 5.0, 0.37)
    assert frame.chroma[0][round(row / 2), round(column / 2)] > 150  # the second robot's blue belt
    world.stage.place("r0", Pose(8, 1, 0))
    assert (await robot[Camera].capture()).chroma[0][round(row / 2), round(column / 2)] < 140
    world.close()


def cut_out(frame, corners):
    """The red of a square given by its corners' pixels, 64 x 64, 0..1."""
    left, top, right, bottom = corners
    rows = np.linspace(top, bottom, 66)[1:-1].round().astype(int)
    columns = np.linspace(left, right, 66)[1:-1].round().astype(int)
    pixels = frame.rgb()[rows][:, columns].astype(float)
    return np.clip((pixels[..., 0] - pixels[..., 1]) / 100, 0, 1)


@pytest.mark.parametrize("symbol", ["1", "7", "8", "B", "heart"])
async def test_a_marker_can_be_read(symbol):
    """The shape in the picture is nearer to its own template than to any other symbol's."""
    from roboglot.simulation.rendering.textures import _heart, _letters

    marker = {"symbol": symbol, "at": [10.0, 5.0], "facing": 180, "height": 0.5, "size": 0.3}
    world, robot, _ = await lab(room(markers=[marker]), start=Pose(8.5, 5))
    pose, inner = world.truth.pose_of("a"), 0.43 * 0.3
    corners = (*pixel(robot, pose, 9.99, 5.0 + inner, 0.5 + inner), *pixel(robot, pose, 9.99, 5.0 - inner, 0.5 - inner))
    found = cut_out(await robot[Camera].capture(), corners)
    likeness = {}
    for other in SYMBOLS:
        template = (_heart() if other == "heart" else _letters(other))[::-1][2::4, 2::4] / 255
        likeness[other] = float(np.corrcoef(template.ravel(), found.ravel())[0, 1])
    assert max(likeness, key=likeness.get) == symbol
    assert likeness[symbol] > 0.85
    world.close()


async def test_line_on_floor_is_seen_where_it_lies():
    world, robot, _ = await lab(room(lines=[{"points": [[2.5, 5.3], [8.0, 5.3]], "width": 0.06}]))
    frame = await robot[Camera].capture()
    for x in (3.5, 5.0, 7.0):
        column, row = pixel(robot, world.truth.pose_of("a"), x, 5.3, 0.0)
        assert frame.chroma[0][round(row / 2), round(column / 2)] > 160
    world.close()


async def test_can_is_seen_in_place_and_foil_shines():
    foil = {"at": [10, 4.2], "facing": 180, "base": 0.1, "top": 0.7}
    tag = {"at": [10, 6.0], "facing": 180, "text": "17", "size": 0.3}
    floor = room(
        things=[{"name": "can", "at": [3.6, 5.2], "diameter": 0.1, "height": 0.12}], reflectors=[foil], tags=[tag]
    )
    world, robot, _ = await lab(floor)
    pose = world.truth.pose_of("a")
    column, row = pixel(robot, pose, 3.55, 5.2, 0.06)
    assert reds(await robot[Camera].capture())[round(row / 2), round(column / 2)]
    world.truth.thing("can").put(np.array((3.6, 4.6, 0.0)))
    frame = await robot[Camera].capture()
    assert not reds(frame)[round(row / 2), round(column / 2)]
    column, row = pixel(robot, pose, 3.55, 4.6, 0.06)
    assert reds(frame)[round(row / 2), round(column / 2)]
    column, row = pixel(robot, pose, 10, 4.2, 0.4)
    assert frame.luma[round(row), round(column)] > 210
    (left, top), (right, bottom) = pixel(robot, pose, 10, 6.15, 0.55), pixel(robot, pose, 10, 5.85, 0.25)
    code = frame.luma[round(top) : round(bottom), round(left) : round(right)]
    assert code.min() < 60
    assert code.max() > 120
    world.close()


async def test_camera_moves_with_the_robot_and_its_legs():
    world, robot, clock = await lab(room())
    high = robot[Camera].mount.z
    robot[Legs].lie_down()
    await clock.advance(3.0)
    assert robot[Camera].mount.z == pytest.approx(high - 0.15, abs=0.01)
    world.close()


async def test_a_gimbal_turns_the_camera():
    """A person to the left is not seen ahead, and stands where geometry says once the gimbal looks there."""
    world, robot, clock = await lab(room(people=[{"path": [[2.2, 8.5]]}]), body="robomaster_ep")
    robot[Gimbal].set_mode(FollowMode.FREE)
    assert not reds(await robot[Camera].capture()).any()
    robot[Gimbal].move_to(pitch=math.radians(-10), yaw=math.radians(87))
    await clock.advance(3.0)
    mount = robot[Camera].mount
    assert (mount.pitch, mount.yaw) == pytest.approx((math.radians(-10), math.radians(87)), abs=0.03)
    rows, columns = np.nonzero(reds(await robot[Camera].capture()))
    lens = world.truth.pose_of("a").compose(Pose(mount.x, mount.y))
    focal = 640 / math.tan(robot[Camera].fov / 2)
    off = wrap_angle(lens.point.bearing_to(Point(2.2, 8.5)) - mount.yaw - world.truth.pose_of("a").yaw)
    assert 2 * columns.mean() == pytest.approx(640 - focal * math.tan(off), abs=15)
    assert len(rows) > 500
    world.close()


async def test_exposure_makes_it_darker_and_brighter():
    world, robot, _ = await lab(room())
    camera = robot[Camera]
    means = []
    for stops in (-1.0, 0.0, 1.0):
        camera.set_exposure(stops)
        means.append(float((await camera.capture()).luma.mean()) - 16)
    assert means[0] == pytest.approx(means[1] / 2, rel=0.05)
    assert means[2] > 1.2 * means[1]
    for bad in (EXPOSURE_MAX + 0.1, math.nan):
        with pytest.raises(InvalidGoal):
            camera.set_exposure(bad)
    assert camera.exposure == 1.0
    world.close()


async def test_nothing_is_drawn_unwatched_and_once_for_many():
    world, robot, clock = await lab(room())
    camera = robot[Camera]
    await clock.advance(1.0)
    assert camera.drawn == 0
    with camera.subscribe() as one, camera.subscribe() as other:
        seen = []
        for _ in range(10):
            await clock.advance(0.1)
            mine, theirs = one.drain(), other.drain()
            assert [a is b for a, b in zip(mine, theirs, strict=True)] == [True] * len(mine)
            seen += mine
        assert camera.drawn == 31
        stamps = [frame.stamp for frame in seen]
        assert all(a < b for a, b in pairwise(stamps))
    await clock.advance(1.0)
    assert camera.drawn == 31
    world.close()


async def test_a_slow_viewer_gets_the_newest_pictures():
    world, robot, clock = await lab(room())
    with robot[Camera].subscribe() as viewer:
        await clock.advance(1.0)
        frames = viewer.drain()
        assert len(frames) <= 2
        assert frames[-1].stamp == pytest.approx(clock.time(), abs=0.04)
        assert viewer.dropped > 25
    world.close()


async def test_viewers_are_limited_and_end_with_the_world():
    world, robot, _ = await lab(room())
    viewers = [robot[Camera].subscribe() for _ in range(VIEWERS_MAX)]
    with pytest.raises(Busy):
        robot[Camera].subscribe()
    world.close()
    assert [frame async for frame in viewers[0]] == []


async def test_the_same_seed_gives_the_same_bytes():
    async def film():
        people = [{"path": [[5.0, 3.0], [5.0, 7.0]], "pause": 0.1}]
        world, robot, clock = await lab(room(people=people), seed=4)
        robot[Base].set_velocity(Twist(0.3, 0.0, 0.4))
        pictures = []
        with robot[Camera].subscribe() as viewer:
            for _ in range(5):
                await clock.advance(0.2)
                pictures.append(viewer.drain()[-1].planes.tobytes())
        world.close()
        return pictures

    first = await film()
    assert first == await film()
    assert len(set(first)) == 5


async def test_an_unchanged_view_is_not_drawn_again():
    """And anything that changes it is seen at once."""
    floor = room(people=[{"path": [[6.0, 5.8]]}], things=[{"name": "can", "at": [3.6, 5.2]}])
    world, robot, clock = await lab(floor, others=[Pose(4.5, 5, math.pi)])
    camera, box = robot[Camera], world.stage.add_obstacle(Pose(4.25, 4.2), (0.5, 0.5, 0.6))
    changes = (
        lambda: world.stage.place("r0", Pose(4.6, 5, math.pi)),
        lambda: world.stage.place("a", Pose(2, 5.01)),
        lambda: world.truth.thing("can").put(np.array((3.6, 4.9, 0.0))),
        lambda: world.stage.remove_obstacle(box),
        lambda: camera.set_exposure(0.5),
    )
    for change in changes:
        await clock.advance(1.0)  # what moved comes to rest
        before = await camera.capture()
        await clock.advance(0.1)
        again = await camera.capture()
        assert again.planes is before.planes
        assert again.stamp > before.stamp
        change()
        assert ((await camera.capture()).planes != again.planes).any()
    world.close()


async def test_a_frame_is_sound_and_read_only():
    world, robot, _ = await lab(room())
    frame = await robot[Camera].capture()
    assert (frame.width, frame.height) == (1280, 720)
    assert frame.luma.min() >= 16
    assert frame.luma.max() <= 235
    assert frame.rgb().shape == (720, 1280, 3)
    with pytest.raises(ValueError, match="read-only"):
        frame.luma[0, 0] = 0
    world.close()


async def test_real_time_pictures_come_from_thread_until_close():
    world, robot, _ = await lab(room(), clock=RealClock())
    with robot[Camera].subscribe() as viewer:
        frames = [await asyncio.wait_for(anext(viewer), 30) for _ in range(3)]
        assert frames[0].stamp < frames[1].stamp < frames[2].stamp
    pictures = await asyncio.gather(*(robot[Camera].capture() for _ in range(3)))
    assert len({picture.stamp for picture in pictures}) == 3
    world.close()


async def test_real_time_camera_waits_for_slow_encoder():
    world, robot, _ = await lab(room(), clock=RealClock())
    with robot[Camera].subscribe() as viewer:
        await asyncio.wait_for(anext(viewer), 30)
        await robot.clock.sleep(0.3)  # the time of nine pictures
        assert robot[Camera].drawn <= 3  # the one that was read, and a pending one
    world.close()


@pytest.mark.parametrize("name", ["office", "empty"])
async def test_every_floor_of_shipped_worlds_can_be_drawn(name):
    from roboglot.simulation.world.world_files import load_world

    description = load_world(name)
    world = World(description, [RobotPlacement("a")], clock=LockstepClock())
    robot = Robot("a", world.description_of("a"), LockstepClock())
    world.equip(robot)
    for floor in range(len(description.floors)):
        places = (Pose(5.0 + step, 5.0, 1.0) for step in range(10))
        world.stage.place("a", next(at for at in places if not world.truth.in_the_way("a", at, floor)), floor)
        frame = await robot[Camera].capture()
        assert frame.luma.std() > 10
    world.close()


async def test_objects_left_out_would_not_be_in_picture(simulate, monkeypatch):
    from roboglot.simulation.rendering import stage

    names = ("a", "b", "c", "d", "e")
    sim = simulate("empty", start=Pose(5, 5), robots=names)
    ring = [(angle, away) for angle in (0.0, 0.5, 0.62, 0.75, 0.95) for away in (0.55, 0.8, 1.6)]
    seen: dict[bool, list[bytes]] = {True: [], False: []}
    for cull in (True, False):
        if not cull:
            monkeypatch.setattr(stage._Sector, "has", lambda *_: True)
        for turn in (1.0, -1.0):
            for places in zip(*[iter(ring)] * 4, strict=False):
                for name, (angle, away) in zip(names[1:], places, strict=True):
                    at = (5 + away * math.cos(turn * angle), 5 + away * math.sin(turn * angle))
                    sim.world._population.hull(name).place(Pose(*at, 1.0), 0)  # even inside of each other
                seen[cull].append((await sim.robot[Camera].capture()).planes.tobytes())
    assert seen[True] == seen[False]
    assert len(set(seen[True])) == 5  # the last ones show no person on either side
