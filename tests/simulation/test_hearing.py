"""Claps are counted in the microphone's own sound; voices are named after the members."""

import pytest

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.geometry import Point
from roboglot.model.sound import tone
from roboglot.simulation.components.sensing.hearing import own_voice
from roboglot.simulation.sound.sound import Source, Speech
from roboglot.storage.database import Database
from roboglot.storage.members import StoredMembers
from tests.simulation.perceiving import lab

ANNA = {"name": "anna", "path": [[6.0, 5.0]], "facing": 180}


@pytest.mark.parametrize("count", [1, 2, 3])
async def test_claps_are_counted(count):
    with lab(people=[ANNA]) as room, room.robot[Hearing].claps() as viewer:
        await room.clock.advance(0.5)
        room.world.stage.person("anna").clap(count)
        await room.clock.advance(0.35 * count)
        assert viewer.drain() == []  # another one may follow
        await room.clock.advance(1.5)
        (heard,) = viewer.drain()
    assert heard.count == count
    assert heard.stamp == pytest.approx(0.5 + 0.35 * (count - 1), abs=0.06)


async def test_runs_of_claps_are_distinguished():
    with lab(people=[ANNA]) as room, room.robot[Hearing].claps() as viewer:
        anna = room.world.stage.person("anna")
        anna.wait(0.5)
        anna.clap(2)
        anna.wait(1.5)
        anna.clap(3)
        await room.clock.advance(6.0)
        assert [heard.count for heard in viewer.drain()] == [2, 3]


async def test_talking_and_tones_are_no_claps():
    with lab(people=[ANNA]) as room, room.robot[Hearing].claps() as viewer:
        room.world.stage.person("anna").say("this is a rather long sentence without any clapping in it")
        room.world.stage.make_sound(tone(800.0, 1.0), Point(3.0, 5.0))
        await room.clock.advance(6.0)
        assert viewer.drain() == []


async def test_claps_behind_walls_or_far_are_not_heard():
    far = ANNA | {"path": [[95.0, 95.0]]}
    with lab(people=[far], size=100.0) as room, room.robot[Hearing].claps() as viewer:
        room.world.stage.person("anna").clap(2)
        await room.clock.advance(3.0)
        assert viewer.drain() == []


async def test_a_voice_gets_its_members_name():
    with lab(people=[ANNA]) as room:
        database = Database(":memory:")
        members = room.robot.add(Members, StoredMembers(database, "a", room.clock, room.robot.events))
        await members.add("Anna")
        await members.set_voice("Anna", room.world.stage.person("anna").voice)
        with room.robot[Hearing].speech() as viewer:
            room.world.stage.person("anna").say("hello")
            await room.clock.advance(2.0)
            (speech,) = viewer.drain()
        database.close()
    assert (speech.name, speech.text) == ("Anna", "hello")


async def test_a_robot_does_not_understand_itself_but_others():
    with lab(robots=("a", "b")) as room:
        sound = tone(200.0, 0.5)
        with room.robots["a"][Hearing].speech() as own, room.robots["b"][Hearing].speech() as other:
            await room.clock.advance(0.1)
            at = room.world.truth.pose_of("a").point
            source = Source(sound, at, 0, room.clock.time(), 1.0, Speech("hello", own_voice("a")))
            room.world._environment.air.emit(source)
            await room.clock.advance(2.0)
            assert own.drain() == []
            assert [speech.text for speech in other.drain()] == ["hello"]


async def test_nothing_is_listened_to_while_no_one_asks():
    with lab(people=[ANNA]) as room:
        microphone = room.robot[Microphone]
        viewer = room.robot[Hearing].claps()
        await room.clock.advance(0.5)
        assert microphone._feed.viewers == 1
        viewer.close()
        await room.clock.advance(0.5)
        assert microphone._feed.viewers == 0
