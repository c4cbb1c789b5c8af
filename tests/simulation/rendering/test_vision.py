"""Detectors see what geometry says: in the picture, near enough, turned this way, with nothing in between."""

import asyncio
import math

import pytest

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.geometry import Pose
from roboglot.model.perception import Colour, Emotion, Gesture, TagKind
from roboglot.simulation.world.declarations import BadFile
from roboglot.storage.database import Database
from roboglot.storage.members import StoredMembers
from tests.simulation.perceiving import START, appears, lab

ANNA = {"name": "anna", "path": [[6.0, 5.0]], "facing": 180, "height": 1.75, "age": 30.0, "emotion": "happy"}
ONE = {"at": [6.0, 5.0], "facing": 180, "symbol": "1", "height": 0.5, "size": 0.3, "colour": "red"}
KINDS = ("people", "faces", "gestures", "skeletons", "markers", "lines", "robots", "tags")


def assert_box(box, corners, robot=START):
    """Within 2 % of the picture of what the corners span."""
    places = [appears(*corner, robot) for corner in corners]
    x0, x1 = min(x for x, _ in places), max(x for x, _ in places)
    y0, y1 = min(y for _, y in places), max(y for _, y in places)
    x0, x1, y0, y1 = (min(1.0, max(0.0, value)) for value in (x0, x1, y0, y1))
    found = (box.x - box.width / 2, box.x + box.width / 2, box.y - box.height / 2, box.y + box.height / 2)
    assert found == pytest.approx((x0, x1, y0, y1), abs=0.02)


def block(low, high):
    return [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]


# -- people ------------------------------------------------------------------------------------------------------------


async def test_a_person_is_where_the_picture_has_them():
    with lab(people=[ANNA]) as room:
        (seen,) = await room.see("people")
    assert_box(seen.box, block((5.79, 4.69, 0.0), (6.12, 5.31, 1.75)))
    assert seen.distance == pytest.approx(math.hypot(3.75, 0.7), rel=0.08)
    assert (seen.place.x, seen.place.y) == (pytest.approx(4.0, abs=0.3), pytest.approx(0.0, abs=0.1))


@pytest.mark.parametrize(
    "things",
    [
        {"people": [ANNA | {"path": [[0.8, 5.0]]}]},  # behind
        {"people": [ANNA | {"path": [[4.0, 9.5]]}]},  # beside the picture
        {"people": [ANNA | {"path": [[19.5, 5.0]]}], "size": 20.0},  # too far
        {"people": [ANNA], "walls": [{"from": [5, 0], "to": [5, 10]}]},
        {"people": [ANNA], "furniture": [{"shape": "box", "at": [5, 5], "size": [0.3, 1.5, 1.9]}]},
        {"people": [ANNA], "furniture": [{"shape": "cylinder", "at": [5, 5], "radius": 0.5, "height": 1.9}]},
    ],
)
async def test_a_person_is_not_seen(things):
    with lab(**things) as room:
        assert await room.see("people") == []


async def test_a_door_lets_one_see_through_a_wall():
    with lab(people=[ANNA], walls=[{"from": [5, 0], "to": [5, 10], "doors": [{"at": 5.0, "width": 1.2}]}]) as room:
        assert len(await room.see("people")) == 1


async def test_a_desk_hides_the_legs_only():
    desk = {"shape": "box", "at": [5.2, 5], "size": [0.6, 1.6, 0.74]}
    with lab(people=[ANNA], furniture=[desk]) as room:
        assert len(await room.see("people")) == 1
        (skeleton,) = await room.see("skeletons")
    assert [joint.visible for joint in skeleton.joints[:7]] == [True] * 7
    assert not any(joint.visible for joint in skeleton.joints[13:])


async def test_people_hide_one_another_and_keep_their_numbers():
    with lab(people=[ANNA, {"name": "ben", "path": [[4.6, 5.0]], "facing": 180, "height": 1.9, "radius": 0.3}]) as room:
        assert len(await room.see("people")) == 1
        room.world.stage.person("ben").place(4.6, 6.2, 180)
        before = await room.see("people")
        room.world.stage.person("ben").place(4.6, 3.8, 180)
        after = await room.see("people")
    assert [seen.number for seen in before] == [seen.number for seen in after] == [1, 2]  # ben is nearer
    assert before[0].place.y > 1.0 > -1.0 > after[0].place.y


async def test_another_floor_is_another_world():
    with lab(people=[ANNA], floors=2) as room:
        room.world.stage.place("a", Pose(2, 5), floor=1)
        assert await room.see("people") == []


# -- faces and gestures ------------------------------------------------------------------------------------------------


async def test_face_is_a_strangers_until_it_is_known():
    with lab(people=[ANNA]) as room:
        (stranger,) = await room.see("faces")
        database = Database(":memory:")
        members = room.robot.add(Members, StoredMembers(database, "a", room.clock, room.robot.events))
        await members.add("Anna")
        assert (await room.see("faces"))[0].name == ""
        await members.set_face("Anna", stranger.print)
        (known,) = await room.see("faces")
        database.close()
    assert (stranger.name, known.name) == ("", "Anna")
    assert stranger.print == room.world.stage.person("anna").face
    assert known.age == pytest.approx(30.0, abs=6.0)
    assert known.emotion is Emotion.HAPPY
    assert_box(known.box, block((5.9, 4.91, 1.5), (6.1, 5.09, 1.77)))


async def test_a_face_must_look_here_and_be_near():
    with lab(people=[ANNA]) as room:
        anna = room.world.stage.person("anna")
        anna.place(6.0, 5.0, 100)
        assert await room.see("faces") == []
        assert len(await room.see("people")) == 1
        anna.place(6.0, 5.0, 130)
        assert len(await room.see("faces")) == 1
    with lab(people=[ANNA | {"path": [[13.0, 5.0]]}], size=20.0) as hall:
        assert await hall.see("faces") == []
        assert len(await hall.see("people")) == 1


@pytest.mark.parametrize(
    "gesture", [pytest.param(one, marks=[pytest.mark.slow] if n % 4 else []) for n, one in enumerate(Gesture)]
)
async def test_every_gesture_is_reported_after_a_moment(gesture):
    with lab(people=[ANNA]) as room:
        room.world.stage.person("anna").gesture(gesture, seconds=2.0)
        assert await room.see("gestures", 0.35) == []
        (seen,) = await room.see("gestures", 1.0)
        assert seen.gesture is gesture
        assert await room.see("gestures", 2.0) == []


async def test_gestures_are_made_towards_the_robot():
    with lab(people=[ANNA]) as room:
        anna = room.world.stage.person("anna")
        anna.place(6.0, 5.0, 0)
        anna.gesture(Gesture.STOP, seconds=5.0)
        assert await room.see("gestures", 1.0) == []


# -- cards -------------------------------------------------------------------------------------------------------------


async def test_a_marker_is_where_the_picture_has_it():
    with lab(markers=[ONE]) as room:
        (seen,) = await room.see("markers")
    assert (seen.symbol, seen.colour) == ("1", Colour.RED)
    assert seen.distance == pytest.approx(3.75, rel=0.08)
    assert_box(seen.box, block((6.0, 4.85, 0.35), (6.0, 5.15, 0.65)))


@pytest.mark.parametrize(
    ("change", "furniture"),
    [
        ({"facing": 0}, []),  # its back
        ({"facing": 110}, []),  # too much from the side
        ({"size": 0.05}, []),  # too small
        ({"at": [6.0, 9.0]}, []),
        ({}, [{"shape": "box", "at": [4.0, 5.0], "size": [0.1, 0.2, 0.6]}]),
        ({}, [{"shape": "cylinder", "at": [4.0, 5.03], "radius": 0.02, "height": 0.6}]),  # a table leg across it
    ],
)
async def test_a_marker_cannot_be_read(change, furniture):
    with lab(markers=[ONE | change], furniture=furniture) as room:
        assert await room.see("markers") == []


async def test_obstacle_before_a_marker_hides_it():
    with lab(markers=[ONE]) as room:
        number = room.world.stage.add_obstacle(Pose(5, 5))
        assert await room.see("markers") == []
        room.world.stage.remove_obstacle(number)
        assert len(await room.see("markers")) == 1


async def test_tags_are_seen_with_their_relative_pose():
    robot = Pose(2, 5, 0.3)
    tags = [
        {"at": [4.5, 6.2], "facing": 200, "text": "42", "height": 0.5},
        {"at": [5.0, 6.0], "facing": 180, "text": "shelf A", "kind": "qr", "size": 0.4},
    ]
    with lab(tags=tags, start=robot) as room:
        april, code = await room.see("tags")
    assert (april.kind, april.text, code.kind, code.text) == (TagKind.APRIL, "42", TagKind.QR, "shelf A")
    truth = Pose(4.5, 6.2, math.radians(200)).relative_to(robot)
    assert april.pose.distance_to(truth) < 0.2
    assert math.remainder(april.pose.yaw - truth.yaw, math.tau) == pytest.approx(0.0, abs=0.06)
    assert april.height == pytest.approx(0.5, abs=0.02)


async def test_tags_of_docks_and_shelves_go_with_them():
    with lab(
        docks=[{"at": [6.0, 5.0], "facing": 180, "tag": 3}],
        shelves=[{"at": [5.0, 6.0], "facing": 180, "clearance": 0.6, "height": 1.0, "tag": 4}],
    ) as room:
        seen = {tag.text: tag.pose for tag in await room.see("tags")}
        assert seen["3"].distance_to(Pose(4.0, 0.0)) < 0.3
        assert seen["4"].distance_to(Pose(3.45, 1.0)) < 0.3
        room.world.building.move_dock(Pose(5.0, 4.5, math.pi), 0, 0)
        room.world.building.shelves[0].move(Pose(4.5, 5.8, math.pi), 0, 0.05)
        moved = {tag.text: tag for tag in await room.see("tags")}
    assert moved["3"].pose.distance_to(Pose(3.0, -0.5)) < 0.2
    assert moved["4"].pose.distance_to(Pose(2.95, 0.8)) < 0.2
    assert moved["4"].height == pytest.approx(0.40, abs=0.02)


@pytest.mark.parametrize(
    ("tag", "message"),
    [
        ({"text": "587"}, "a number from 0 to 586"),
        ({"text": "x"}, "a number"),
        ({"text": "坐" * 40, "kind": "qr"}, "106"),
    ],
)
def test_bad_tags(tag, message):
    with pytest.raises(BadFile, match=message), lab(tags=[{"at": [5, 5]} | tag]):
        pass


# -- lines -------------------------------------------------------------------------------------------------------------


async def test_a_straight_line_ahead():
    with lab(lines=[{"points": [[2.0, 5.0], [9.0, 5.0]], "colour": "blue"}]) as room:
        (line,) = await room.see("lines")
    assert line.colour is Colour.BLUE
    assert len(line.points) == 10
    for point in line.points:
        assert point.x == pytest.approx(0.5, abs=0.01)
        assert point.angle == pytest.approx(0.0, abs=0.02)
        assert point.curvature == pytest.approx(0.0, abs=0.1)
    heights = [point.y for point in line.points]
    assert heights == sorted(heights, reverse=True)  # the nearest first: at the bottom
    assert heights[-1] == pytest.approx(appears(5.24, 5.0, 0.0)[1], abs=0.02)


@pytest.mark.parametrize("drawn", [1, -1])  # moving away from the robot, or towards it
@pytest.mark.parametrize("side", [1, -1])
async def test_a_bend_has_the_curvature_of_its_circle(side, drawn):
    radius, middle = 2.0, (3.0, 5.0 + side * 2.0)
    angles = [math.radians(-side * (90 - degrees)) for degrees in range(0, 61, 3)]
    bend = [[middle[0] + radius * math.cos(a), middle[1] + radius * math.sin(a)] for a in angles]
    with lab(lines=[{"points": bend[::drawn], "colour": "red"}]) as room:
        (line,) = await room.see("lines")
    assert line.points[0].y > line.points[-1].y
    middle_points = line.points[2:-2]
    assert all(point.curvature == pytest.approx(side / radius, abs=0.12) for point in middle_points)
    assert all(point.angle * -side > 0 for point in middle_points)  # a left bend leads to the left


async def test_lines_of_all_colours_are_seen_where_visible():
    lines = [
        {"points": [[2.5, 5.2], [5.0, 5.2]], "colour": "red"},
        {"points": [[2.5, 4.8], [5.0, 4.8]], "colour": "green"},
        {"points": [[0.2, 4.0], [1.5, 4.0]], "colour": "blue"},  # behind
        {"points": [[6.5, 4.0], [6.5, 6.0]], "colour": "yellow"},  # far
    ]
    with lab(lines=lines) as room:
        assert {line.colour for line in await room.see("lines")} == {Colour.RED, Colour.GREEN}
        room.world.stage.add_obstacle(Pose(4.3, 5.2), (0.3, 0.2, 0.5))
        red = next(line for line in await room.see("lines") if line.colour is Colour.RED)
    assert red.points[-1].y == pytest.approx(appears(4.14, 5.2, 0.0)[1], abs=0.02)


# -- robots ------------------------------------------------------------------------------------------------------------


async def test_another_robot_is_seen_and_hidden():
    with lab(robots=("a", "b")) as room:
        room.world.stage.place("b", Pose(5, 5.5))
        (seen,) = await room.see("robots")
        assert seen.distance == pytest.approx(2.8, rel=0.1)
        assert (seen.place.x, seen.place.y) == (pytest.approx(3.0, abs=0.3), pytest.approx(0.5, abs=0.15))
        around = [(5 + 0.25 * math.cos(a / 8), 5.5 + 0.25 * math.sin(a / 8)) for a in range(50)]
        assert_box(seen.box, [(x, y, z) for x, y in around for z in (0.03, 0.4)])
        assert await room.see("robots", robot="b") == []  # it looks the other way
        room.world.stage.add_obstacle(Pose(3.5, 5.25), (0.2, 1.5, 1.0))
        assert await room.see("robots") == []


# -- the camera's own pose ---------------------------------------------------------------------------------------------


async def test_the_detectors_follow_the_gimbal():
    aside = ONE | {"at": [2.0, 8.0], "facing": 270, "height": 0.3}
    with lab(markers=[aside], body="robomaster_ep") as room:
        assert await room.see("markers") == []
        room.robot[Gimbal].set_mode(FollowMode.FREE)
        room.robot[Gimbal].move_to(yaw=math.radians(90))
        await room.clock.advance(2.0)
        (seen,) = await room.see("markers")
        assert seen.box.x == pytest.approx(0.5, abs=0.02)


async def test_lying_down_one_sees_less_of_the_line():
    from roboglot.model.components.motion.legs import Legs

    with lab(lines=[{"points": [[2.0, 5.0], [9.0, 5.0]]}], markers=[ONE]) as room:
        (standing,) = await room.see("lines")
        room.robot[Legs].lie_down()
        await room.clock.advance(3.0)
        (lying,) = await room.see("lines")
    assert lying.points[0].y - lying.points[-1].y > standing.points[0].y - standing.points[-1].y


# -- time, cost, chance ------------------------------------------------------------------------------------------------


async def test_nothing_is_done_while_no_one_watches():
    with lab(people=[ANNA], markers=[ONE]) as room:
        vision = room.robot[Vision]
        await room.clock.advance(2.0)
        assert sum(getattr(vision, kind).looks for kind in KINDS) == 0
        viewer = vision.markers.subscribe()
        await room.clock.advance(1.0)
        assert vision.markers.looks == 12
        assert vision.people.looks == 0
        assert vision.markers.latest is not None
        viewer.close()
        await room.clock.advance(1.0)
        assert vision.markers.looks == 12
        assert vision.markers.latest is None


async def test_sightings_come_at_the_rate_a_beat_late():
    with lab(markers=[ONE]) as room, room.robot[Vision].markers.subscribe() as viewer:
        await room.clock.advance(0.25)
        first, second = viewer.drain()
        assert (first.stamp, second.stamp) == (pytest.approx(0.08), pytest.approx(0.16))
        assert room.robot[Vision].markers.latest is second


async def test_the_same_seed_sees_the_same():
    async def run(seed):
        with lab(people=[ANNA], markers=[ONE], seed=seed) as room:
            return [await room.see(kind, 0.5) for kind in KINDS]

    assert await run(5) == await run(5)
    assert await run(5) != await run(6)


async def test_viewers_that_do_not_read_cost_no_memory():
    with lab(markers=[ONE]) as room, room.robot[Vision].markers.subscribe() as viewer:
        await room.clock.advance(5.0)
        assert len(viewer.drain()) <= 4


async def test_a_closed_world_ends_the_sightings():
    with lab(markers=[ONE]) as room:
        viewer = room.robot[Vision].markers.subscribe()
    await asyncio.sleep(0)
    assert [sighting async for sighting in viewer] == []
