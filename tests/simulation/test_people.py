"""People follow their script or a test, one step after the other."""

import math

import pytest

from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Gesture, Sport
from roboglot.model.sports import SportCounter
from roboglot.simulation.people.people import Walker
from roboglot.simulation.people.routine import Say, Show, Wait, Walk
from roboglot.simulation.world.declarations import BadFile
from roboglot.simulation.world.description import Person
from tests.simulation.perceiving import lab

ANNA = {"name": "anna", "path": [[6.0, 5.0]], "facing": 180, "height": 1.75, "speed": 1.0}


async def test_they_do_one_thing_after_the_other():
    with lab(people=[ANNA]) as room:
        anna = room.world.stage.person("anna")
        anna.walk_to(6.0, 8.0)
        anna.gesture(Gesture.STOP, 2.0)
        anna.say("hello")
        await room.clock.advance(1.5)
        assert anna.pose.y == pytest.approx(6.5, abs=0.05)
        assert anna.doing == Walk((6.0, 8.0))
        await room.clock.advance(2.0)
        assert anna.doing == Show(Gesture.STOP, 2.0)
        assert anna.pose.point == Point(6.0, 8.0)
        await room.clock.advance(1.7)
        assert anna.doing == Say("hello")
        await room.clock.advance(2.0)
        assert anna.doing is None


async def test_turning_takes_time_and_standing_is_at_once():
    with lab(people=[ANNA]) as room:
        anna = room.world.stage.person("anna")
        anna.look_at(6.0, 9.0)
        await room.clock.advance(0.3)
        assert math.radians(90) < anna.pose.yaw < math.radians(180)
        await room.clock.advance(1.0)
        assert anna.pose.yaw == pytest.approx(math.radians(90))
        anna.walk_to(9.0, 5.0)
        await room.clock.advance(1.0)
        anna.stand()
        here = anna.pose
        await room.clock.advance(1.0)
        assert anna.pose == here


async def test_scripts_begin_anew_and_wait_while_someone_directs():
    script = [{"do": "walk", "to": [6.0, 6.0]}, {"do": "wait", "seconds": 1.0}, {"do": "walk", "to": [6.0, 5.0]}]
    with lab(people=[ANNA | {"script": script}]) as room:
        anna = room.world.stage.person("anna")
        await room.clock.advance(1.5)
        assert anna.pose.y == pytest.approx(6.0, abs=0.1)
        await room.clock.advance(1.6)
        assert anna.pose.y == pytest.approx(5.0, abs=0.1)
        await room.clock.advance(0.5)
        assert anna.pose.y > 5.2  # the second time
        anna.stand()
        await room.clock.advance(5.0)
        assert anna.pose.y < 5.8
        anna.resume()
        await room.clock.advance(2.5)
        assert anna.pose.y != pytest.approx(5.6, abs=0.1)


async def test_moved_person_is_there_for_the_lidar_too():
    from roboglot.model.components.sensing.lidar import Lidar

    with lab(people=[ANNA]) as room:
        room.world.stage.person("anna").place(3.0, 5.0)
        await room.clock.advance(0.3)
        scan = room.robot[Lidar].scan
        assert scan is not None
        assert scan.ranges[180] == pytest.approx(0.78, abs=0.05)


async def test_people_without_a_name_go_by_their_place():
    with lab(people=[{"path": [[1, 1]]}, {"path": [[8, 8]]}]) as room:
        assert room.world.stage.person("person 0 1").pose.point == Point(8, 8)
        with pytest.raises(NotFound, match="no person here is named 'carl'"):
            room.world.stage.person("carl")


async def test_they_refuse_what_no_file_could_say():
    with lab(people=[ANNA]) as room:
        anna = room.world.stage.person("anna")
        with pytest.raises(ValueError, match="count"):
            anna.do_sport(Sport.SQUAT, count=0)
        with pytest.raises(ValueError, match="text"):
            anna.say("")
        with pytest.raises(ValueError, match="finite"):
            anna.place(math.nan, 0.0)
        for _ in range(100):
            anna.clap()
        with pytest.raises(ValueError, match="no more than 100 steps"):
            anna.clap()


@pytest.mark.parametrize(
    ("people", "message"),
    [
        ([ANNA, ANNA], "two people have the name anna"),
        ([ANNA | {"script": [{"do": "walk", "to": [40, 5]}]}], "lies outside the floor"),
    ],
)
def test_bad_casts(people, message):
    with pytest.raises(BadFile, match=message), lab(people=people):
        pass


# -- exercises, as a camera sees and counts them -----------------------------------------------------------------------


@pytest.mark.parametrize("facing", [135, *(pytest.param(facing, marks=pytest.mark.slow) for facing in (90, 180))])
@pytest.mark.parametrize("sport", [sport for sport in Sport if sport is not Sport.PLANK])
async def test_repetitions_are_counted(sport, facing):
    from roboglot.model.components.sensing.vision import Vision

    with lab(people=[ANNA | {"facing": facing}]) as room, room.robot[Vision].skeletons.subscribe() as viewer:
        counter = SportCounter(sport)
        others = [SportCounter(other) for other in Sport if other not in (sport, Sport.PLANK)]
        room.world.stage.person("anna").do_sport(sport, 6, 1.5)
        for _ in range(60):
            await room.clock.advance(0.2)
            for sighting in viewer.drain():
                for skeleton in sighting.seen:
                    for each in (counter, *others):
                        each.see(skeleton, sighting.stamp)
    assert counter.count == 6
    assert {other.sport: other.count for other in others if other.count > 1} == {}


async def test_a_plank_is_timed():
    from roboglot.model.components.sensing.vision import Vision

    with lab(people=[ANNA | {"facing": 90}]) as room, room.robot[Vision].skeletons.subscribe() as viewer:
        counter = SportCounter(Sport.PLANK)
        room.world.stage.person("anna").wait(2.0)
        room.world.stage.person("anna").do_sport(Sport.PLANK, 5, 2.0)
        for _ in range(80):
            await room.clock.advance(0.2)
            for sighting in viewer.drain():
                for skeleton in sighting.seen:
                    counter.see(skeleton, sighting.stamp)
    assert counter.duration == pytest.approx(10.0, abs=0.5)
    assert counter.count == 0


async def test_an_exercise_behind_a_wall_does_not_count():
    wall = {"from": [5, 0], "to": [5, 10]}
    with lab(people=[ANNA], walls=[wall]) as room:
        room.world.stage.person("anna").do_sport(Sport.SQUAT, 3, 1.0)
        assert await room.see("skeletons", 3.0) == []


# -- what they say -----------------------------------------------------------------------------------------------------


async def heard(room, seconds=3.0):
    with room.robot[Hearing].speech() as viewer:
        await room.clock.advance(seconds)
        return viewer.drain()


async def test_nearby_speech_is_understood():
    with lab(people=[ANNA]) as room:
        room.world.stage.person("anna").say("坐下")
        (speech,) = await heard(room)
    assert speech.text == "坐下"
    assert speech.print == room.world.stage.person("anna").voice
    assert speech.name == ""
    assert speech.stamp == pytest.approx(speech.seconds, abs=0.15)


@pytest.mark.parametrize(
    ("things", "texts"),
    [
        ({"people": [ANNA | {"path": [[19.0, 5.0]]}], "size": 20.0}, [""]),  # too far for words
        ({"people": [ANNA | {"path": [[99.0, 5.0]]}], "size": 100.0}, []),  # too far for anything
        ({"people": [ANNA], "walls": [{"from": [5, 0], "to": [5, 10]}]}, []),
    ],
)
async def test_faint_words_are_lost(things, texts):
    with lab(**things) as room:
        room.world.stage.person("anna").say("sit down please")
        assert [speech.text for speech in await heard(room)] == texts


async def test_two_at_once_drown_each_other():
    with lab(people=[ANNA, {"name": "ben", "path": [[6.0, 6.0]]}]) as room:
        room.world.stage.person("anna").say("sit down please")
        room.world.stage.person("ben").say("stand up at once")
        assert all(speech.text == "" for speech in await heard(room))


async def test_robot_that_stands_in_way_is_walked_around():
    with lab(people=[ANNA]) as room:
        anna = room.world.stage.person("anna")
        room.world.stage.place("a", Pose(4.0, 5.0))
        anna.walk_to(1.5, 5.0)
        await room.clock.advance(3.5)  # she waits a while
        assert anna.pose.point == Point(anna.pose.x, 5.0)
        assert anna.pose.x == pytest.approx(4.8, abs=0.05)
        nearest = 9.0
        for _ in range(80):
            await room.clock.advance(0.1)
            nearest = min(nearest, room.world.truth.pose_of("a").distance_to(anna.pose))
        assert anna.pose.point == Point(1.5, 5.0)
        assert nearest > 0.45
        assert room.world.truth.pose_of("a").distance_to(Pose(4.0, 5.0)) < 0.02  # it was not pushed


async def test_people_step_back_without_room_aside():
    walls = [{"from": [2.0, 4.6], "to": [9.0, 4.6]}, {"from": [2.0, 5.4], "to": [9.0, 5.4]}]
    with lab(people=[ANNA], walls=walls) as room:
        anna = room.world.stage.person("anna")
        room.world.stage.place("a", Pose(4.0, 5.0))
        anna.walk_to(1.5, 5.0)
        await room.clock.advance(6.0)
        assert anna.pose.x > 5.5
        assert anna.pose.y == pytest.approx(5.0)


def test_a_wait_ends_in_its_tick():
    anna = Walker(Person(path=((6.0, 5.0),), script=(Wait(1.0), Walk((6.0, 9.0)))), 0)
    changed = []
    for tick in range(1, 61):
        if tick == 20:
            anna.place(Pose(5.0, 5.0))
        if anna.walk(0.02, (), lambda _walker, _spot: True):
            changed.append(tick)
    last = next(tick for tick in range(1, 100) if sum([0.02] * tick) >= 1.0)
    assert changed == [20, *range(last + 1, 61)]
    anna.resume()  # in the midst of a step
    assert [anna.walk(0.02, (), lambda _walker, _spot: True) for _ in range(3)] == [False] * 3  # the wait again
    again = Walker(Person(path=((6.0, 5.0),), script=(Wait(9.0),)), 0)
    again.walk(0.02, (), lambda _walker, _spot: True)
    again.order(Walk((6.0, 9.0)))  # leaves a wait at once
    assert again.walk(0.02, (), lambda _walker, _spot: True)
