"""cyberdog.gesture, skeleton, personnel, train: people in the world do something, programs learn of it."""

from __future__ import annotations

from typing import Any

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.interaction.training_words import REPEATS, TrainingWords
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.events import ActionChanged, Spoke
from roboglot.model.geometry import Pose
from roboglot.model.perception import Emotion, Gesture, Sport
from roboglot.programs.functions.enums import ENUMS, GESTURES
from roboglot.simulation.people.stage_people import Actor
from roboglot.simulation.world.world import World
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("playground")
HOLD, THUMB = ENUMS["GestureType"]["stop_sign"], ENUMS["GestureType"]["thumb_up"]


@pytest.fixture
async def anna(caller: Caller, world: World) -> Actor:
    """A person in front of the camera, and no one else in sight."""
    world.stage.place("a", Pose(2.0, 5.0))
    ben, anna = world.stage.person("ben"), world.stage.person("anna")
    ben.stand()
    ben.place(1.0, 7.5, 90)
    anna.stand()
    anna.place(6.0, 5.0, 180)
    await caller.clock.advance(0.5)
    return anna


# -- gestures ----------------------------------------------------------------------------------------------------------


def test_every_gesture_of_manual_has_one_of_models() -> None:
    from roboglot.programs.functions.senses.gestures import KINDS

    assert KINDS[Gesture.THUMB_DOWN] == "thumb_down" == GESTURES[8 - 1]
    assert KINDS[Gesture.OPEN] == "zooming_in_with_hand_or_two_fingers" == GESTURES[10 - 1]
    assert set(KINDS.values()) == set(GESTURES)


async def test_any_gesture_is_waited_for(caller: Caller, anna: Actor) -> None:
    waiting = caller.start("cyberdog.gesture.recognized", 30, 1)
    await caller.clock.advance(2.0)
    assert not waiting.done()
    anna.gesture(Gesture.PULL, seconds=2)
    await caller.clock.advance(1.5)
    result = waiting.result()
    assert field(result, "data").fields == {"pulling_hand_or_two_fingers_in": True}
    assert field(result, "state.code") == 0


async def test_a_designated_gesture_and_no_other(caller: Caller, anna: Actor) -> None:
    assert field(await caller("cyberdog.gesture.turn_on_recognition", 30), "response.code") == 0
    waiting = caller.start("cyberdog.gesture.recognized_designated_gesture", 20, THUMB)
    anna.gesture(Gesture.STOP, seconds=3)
    await caller.clock.advance(4.0)
    assert not waiting.done()
    anna.gesture(Gesture.THUMB_UP, seconds=2)
    await caller.clock.advance(2.0)
    assert field(waiting.result(), "data").fields["thumb_up"] is True
    assert field(await caller("cyberdog.gesture.turn_off_recognition"), "response.code") == 0
    assert caller.robot[Vision].gestures.latest is None


async def test_no_gesture_in_time_is_no_failure(caller: Caller, anna: Actor) -> None:
    await caller("cyberdog.gesture.turn_on_recognition", 60)
    start = caller.clock.time()
    result = await caller("cyberdog.gesture.recognized_designated_gesture", 2, HOLD)
    assert (field(result, "state.code"), field(result, "data").fields) == (0, {})
    assert caller.clock.time() - start == pytest.approx(2.0, abs=0.1)
    caller.session.cancel("the end")
    assert caller.robot[Vision].gestures.latest is None


async def test_gestures_of_busy_seconds_count(caller: Caller, anna: Actor) -> None:
    """They were lost where the program did something else for more than four pictures."""
    await caller("cyberdog.gesture.turn_on_recognition", 30)
    anna.gesture(Gesture.STOP, seconds=1)
    await caller("time.sleep", 6.0)
    result = await caller("cyberdog.gesture.recognized_any_gesture", 30, 10)
    assert field(result, "data").fields == {"stop_sign": True}


@pytest.mark.slow
async def test_recognition_ends_by_itself(caller: Caller, anna: Actor) -> None:
    await caller("cyberdog.gesture.turn_on_recognition", 30)
    await caller.clock.advance(31.0)
    assert caller.robot[Vision].gestures.latest is None  # nothing looks any more
    assert field(await caller("cyberdog.gesture.recognized_any_gesture", 30), "state.code") == 1


@pytest.mark.parametrize(
    ("name", "args"),
    [
        ("turn_on_recognition", (29,)),
        ("turn_on_recognition", (301,)),
        ("recognized", (5,)),
        ("recognized_any_gesture", (60,)),  # not on
        ("recognized_designated_gesture", (10, 0)),
        ("recognized_designated_gesture", (10, 12)),
        ("recognized_designated_gesture", (0, 1)),
    ],
)
async def test_gestures_that_cannot_be_recognised(caller: Caller, name: str, args: tuple[int, ...]) -> None:
    assert field(await caller(f"cyberdog.gesture.{name}", *args), "state.code") == 1
    assert caller.robot[Vision].gestures.latest is None


@pytest.mark.parametrize(
    ("name", "args", "seconds"),
    [
        ("gesture.recognized_designated_gesture", (4, THUMB), 4),
        ("skeleton.blocking_recognized", (6,), 6),
        ("personnel.face_recognized", (["Ben"], False, 30), 30),
        ("personnel.voiceprint_recognized", (["Ben"], False, 3), 3),
        ("train.training_words_recognized", (5,), 5),
        ("lidar.get_data", (2,), 2),
    ],
)
async def test_busy_machine_makes_no_wait_longer(
    caller: Caller, world: World, anna: Actor, monkeypatch: pytest.MonkeyPatch, name: str, args: Any, seconds: float
) -> None:
    """Each look was taken to last as long as it should; at ten times the speed a timeout of 30 s took 41."""
    await caller.robot[Members].add("Ben")
    await caller("cyberdog.gesture.turn_on_recognition", 60)
    await caller("cyberdog.skeleton.turn_on_recognition", 1, 5, 60)
    world.faults.inject("lidar_gone", "a")
    await caller.clock.advance(1.5)
    sleep = caller.session.sleep
    monkeypatch.setattr(caller.session, "sleep", lambda seconds: sleep(seconds + 0.04))
    start = caller.clock.time()
    await caller(f"cyberdog.{name}", *args)
    assert caller.clock.time() - start == pytest.approx(seconds, abs=0.15)


async def test_pauses_take_no_time_from_recognition(caller: Caller, anna: Actor) -> None:
    """A program that was held up at a breakpoint found recognition off, and its wait over."""
    await caller("cyberdog.skeleton.turn_on_recognition", 1, 5, 30)
    waiting = caller.start("cyberdog.gesture.recognized", 30)
    await caller.clock.advance(5.0)
    for _ in range(2):
        caller.session.pause()
        caller.session.pause()  # as a suspension at a breakpoint
        await caller.clock.advance(20.0)
        caller.session.resume()
        caller.session.resume()
    await caller.clock.advance(5.0)
    assert not waiting.done()
    anna.gesture(Gesture.STOP, seconds=2)
    await caller.clock.advance(2.0)
    assert field(waiting.result(), "data").fields == {"stop_sign": True}
    assert field(await caller("cyberdog.skeleton.instant_recognized"), "response.algo_switch") == 0
    await caller.clock.advance(20.0)
    assert field(await caller("cyberdog.skeleton.instant_recognized"), "response.algo_switch") == 2


# -- exercises ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow  # in short: test_repetitions_are_counted
async def test_squats_are_counted_while_the_program_goes_on(caller: Caller, anna: Actor) -> None:
    result = await caller("cyberdog.skeleton.turn_on_recognition", ENUMS["SkeletonType"]["squat"], 3, 60)
    assert (field(result, "state.code"), field(result, "response.result")) == (0, 0)
    anna.do_sport(Sport.SQUAT, count=4, period=2.0)
    first = await caller("cyberdog.skeleton.blocking_recognized", 30)
    assert (field(first, "response.counts"), field(first, "response.algo_switch")) == (1, 0)
    await caller.clock.advance(8.0)
    last = await caller("cyberdog.skeleton.instant_recognized")
    assert field(last, "response").fields == {"algo_switch": 1, "sport_type": 1, "counts": 3, "duration": 0}
    assert field(await caller("cyberdog.skeleton.blocking_recognized", 30), "state.code") == 1


async def test_nothing_counts_after_the_time(caller: Caller, anna: Actor) -> None:
    """A program that looked later saw counts of after the time, or even all that it had asked for."""
    await caller("cyberdog.skeleton.turn_on_recognition", 1, 4, 5)
    anna.do_sport(Sport.SQUAT, count=6, period=2.0)
    await caller.clock.advance(5.5)
    assert caller.robot[Vision].skeletons.latest is None
    await caller.clock.advance(8.0)
    last = field(await caller("cyberdog.skeleton.instant_recognized"), "response").fields
    assert (last["algo_switch"], last["counts"]) == (2, 2)


async def test_counts_begin_anew(caller: Caller, anna: Actor) -> None:
    await caller("cyberdog.skeleton.turn_on_recognition", 1, 10, 60)
    anna.do_sport(Sport.SQUAT, count=3, period=1.5)
    await caller.clock.advance(5.0)
    assert field(await caller("cyberdog.skeleton.instant_recognized"), "response.counts") == 3
    await caller("cyberdog.skeleton.turn_on_recognition", 1, 2, 60.5)  # the manual: seconds, as a fraction
    await caller.clock.advance(1.0)
    last = field(await caller("cyberdog.skeleton.instant_recognized"), "response").fields
    assert (last["algo_switch"], last["counts"]) == (0, 0)


async def test_a_plank_is_timed(caller: Caller, anna: Actor) -> None:
    anna.place(5.0, 5.0, 90)
    anna.do_sport(Sport.PLANK, count=6, period=2.0)
    await caller("cyberdog.skeleton.turn_on_recognition", ENUMS["SkeletonType"]["plank"], 4, 30)
    await caller.clock.advance(9.0)
    last = await caller("cyberdog.skeleton.instant_recognized")
    assert (field(last, "response.duration"), field(last, "response.algo_switch")) == (4, 1)


async def test_a_whole_training_with_words(caller: Caller, anna: Actor) -> None:
    with caller.robot.events.subscribe(Spoke) as said:
        anna.do_sport(Sport.SQUAT, count=2, period=3.0)
        result = await caller("cyberdog.skeleton.sports_recognition", 1, 2, 30, True, False, 80)
        texts = [(await said.next()).text for _ in range(3)]
    assert field(result, "response").fields.items() >= {"result": 0, "algo_switch": 1, "counts": 2}.items()
    assert texts == ["1", "2", "done"]


async def test_interrupted_words_fail_no_training(caller: Caller, anna: Actor) -> None:
    """The training failed where another client spoke at the same time."""
    speaker = caller.robot[Speaker]

    def interrupt(event: ActionChanged) -> None:
        if event.action.status is ActionStatus.EXECUTING and event.action.goal == "time is up":
            speaker.say("good evening", source="another")

    caller.robot.events.listen(ActionChanged, interrupt)
    result = await caller("cyberdog.skeleton.sports_recognition", 1, 2, 5)
    assert (field(result, "state.code"), field(result, "response.algo_switch")) == (0, 2)


async def test_refused_training_leaves_the_volume(caller: Caller) -> None:
    before = caller.robot[Speaker].volume
    result = await caller("cyberdog.skeleton.sports_recognition", 1, 0, 5, True, True, 90)
    assert (field(result, "state.code"), caller.robot[Speaker].volume) == (1, before)


@pytest.mark.parametrize("interact", [True, False])
async def test_volume_out_of_range_is_refused_without_speech(caller: Caller, interact: bool) -> None:
    for volume in (-1, 101):
        result = await caller("cyberdog.skeleton.sports_recognition", 1, 2, 5, interact, True, volume)
        assert (field(result, "state.code"), field(result, "response.algo_switch")) == (1, 3)
        for function, args in (("to_preset", ["x"]), ("turn_on_navigation", [False])):
            result = await caller(f"cyberdog.navigation.{function}", *args, False, interact, volume)
            assert field(result, "state.describe") == f"volume = {volume} is outside of 0 to 100 %"


async def test_exercise_of_no_one_is_not_counted(caller: Caller, anna: Actor) -> None:
    result = await caller("cyberdog.skeleton.sports_recognition", 1, 2, 5, False)
    assert field(result, "response").fields.items() >= {"result": 1, "algo_switch": 2, "counts": 0}.items()
    assert caller.robot[Vision].skeletons.latest is None


@pytest.mark.parametrize(("sport", "counts", "timeout"), [(0, 1, 60), (7, 1, 60), (1, 0, 60), (1, 1, 4), (1, 1, 301)])
async def test_impossible_counts_are_refused(caller: Caller, sport: int, counts: int, timeout: int) -> None:
    result = await caller("cyberdog.skeleton.turn_on_recognition", sport, counts, timeout)
    assert (field(result, "state.code"), field(result, "response.result")) == (1, 1)
    assert field(await caller("cyberdog.skeleton.instant_recognized"), "response.algo_switch") == 3


async def test_counting_ends_when_asked_and_with_the_program(caller: Caller, anna: Actor) -> None:
    await caller("cyberdog.skeleton.turn_on_recognition", 1, 5, 60)
    await caller("cyberdog.skeleton.turn_off_recognition")
    assert field(await caller("cyberdog.skeleton.instant_recognized"), "response.algo_switch") == 3
    await caller("cyberdog.skeleton.turn_on_recognition", 1, 5, 60)
    caller.session.cancel("the end")
    assert caller.robot[Vision].skeletons.latest is None


# -- people ------------------------------------------------------------------------------------------------------------


@pytest.mark.slow  # in short: test_members_are_known_by_their_voices
async def test_members_are_known_by_their_faces(caller: Caller, world: World, anna: Actor) -> None:
    members = caller.robot[Members]
    assert field(await caller("cyberdog.personnel.face_recognized", []), "state.code") == 1  # no face is known
    for name in ("Anna", "Ben"):
        await members.add(name)
        await members.set_face(name, world.stage.person(name.lower()).face)
    for people in ([], ["Anna"], [str(members.get("Anna").id)], ["Anna", "Ben"]):
        result = await caller("cyberdog.personnel.face_recognized", people, False, 30)
        assert field(result, "state.code") == 0
        assert set(field(result, "dictionary")) == {"Anna"}
        assert field(field(result, "list")[0], "username") == "Anna"
        assert field(field(result, "list")[0], "age") == pytest.approx(29, abs=6)
    named = await caller("cyberdog.personnel.face_recognized", names=["Anna"], duration=30)  # as the manual calls it
    assert field(named, "state.code") == 0
    start = caller.clock.time()
    both = await caller("cyberdog.personnel.face_recognized", ["Anna", "Ben"], True, 30)
    assert (field(both, "state.code"), set(field(both, "dictionary"))) == (1, {"Anna"})
    assert caller.clock.time() - start == pytest.approx(30, abs=0.5)


async def test_members_are_known_by_their_voices(caller: Caller, world: World, anna: Actor) -> None:
    members = caller.robot[Members]
    for name in ("Anna", "Ben"):
        await members.add(name)
        await members.set_voice(name, world.stage.person(name.lower()).voice)
    waiting = caller.start("cyberdog.personnel.voiceprint_recognized", ["Anna", "Ben"], True, 10)
    anna.say("hello robot")
    await caller.clock.advance(3.0)
    assert not waiting.done()
    world.stage.person("ben").say("me, too")
    await caller.clock.advance(3.0)
    result = waiting.result()
    assert (field(result, "data"), sorted(field(result, "list"))) == (True, ["Anna", "Ben"])
    silent = await caller("cyberdog.personnel.voiceprint_recognized", ["Ben"], False, 1, 0)
    assert (field(silent, "state.code"), field(silent, "data")) == (0, False)


@pytest.mark.parametrize(
    ("name", "args"),
    [
        ("face_recognized", (["unknown"], False, 60)),
        ("face_recognized", ([], False, 29)),
        ("face_recognized", ([], False, float("nan"))),
        ("voiceprint_recognized", (["unknown"], False, 3)),
        ("voiceprint_recognized", ([], False, 31)),
        ("voiceprint_recognized", ([], False, 3, -1)),
        ("voiceprint_recognized", ([], False, 3, 10**400)),
    ],
)
async def test_people_who_cannot_be_recognised(caller: Caller, name: str, args: tuple[object, ...]) -> None:
    await caller.robot[Members].add("Anna")
    start = caller.clock.time()
    assert field(await caller(f"cyberdog.personnel.{name}", *args), "state.code") == 1
    assert caller.clock.time() - start < 0.1


async def test_phrases_that_are_known(caller: Caller, anna: Actor) -> None:
    known = await caller("cyberdog.train.get_training_words_set")
    assert set(field(known, "dictionary")) == {"终止任务", "暂停任务", "继续任务"}
    waiting = caller.start("cyberdog.train.training_words_recognized", 10)
    anna.say("good morning")
    await caller.clock.advance(3.0)
    assert not waiting.done()
    anna.say("暂停任务")
    await caller.clock.advance(3.0)
    word = field(waiting.result(), "response").fields
    assert word == {"trigger": "暂停任务", "type": "vp_task", "value": "suspend"}
    nothing = await caller("cyberdog.train.training_words_recognized", 5)
    assert (field(nothing, "state.code"), field(nothing, "response").fields) == (0, {})
    for seconds in (4, 4.9, 300.1):
        assert field(await caller("cyberdog.train.training_words_recognized", seconds), "state.code") == 1


async def test_a_word_that_someone_teaches_is_understood(caller: Caller, anna: Actor) -> None:
    teaching = caller.robot[TrainingWords].teach("dance", seconds=20.0)
    for _ in range(REPEATS):
        anna.say("跳舞")
        await caller.clock.advance(2.5)
    assert teaching.status is ActionStatus.SUCCEEDED
    known = await caller("cyberdog.train.get_training_words_set")
    taught = {"trigger": "跳舞", "type": "vp_task", "value": "dance"}
    assert field(known, "dictionary")["跳舞"].fields == taught
    assert len(field(known, "response.training_set")) == 4
    waiting = caller.start("cyberdog.train.training_words_recognized", 10)
    await caller.clock.advance(0.1)
    anna.say("跳舞")
    await caller.clock.advance(3.0)
    assert field(waiting.result(), "response").fields == taught


async def test_a_face_shows_what_someone_feels(caller: Caller, anna: Actor) -> None:
    await caller.robot[Members].add("Anna")
    await caller.robot[Members].set_face("Anna", anna.face)
    for emotion, number in ((Emotion.NEUTRAL, 0.0), (Emotion.HAPPY, 1.0), (Emotion.AFRAID, 5.0)):
        anna.feel(emotion)
        await caller.clock.advance(0.5)
        result = await caller("cyberdog.personnel.face_recognized", ["Anna"], False, 30)
        assert field(field(result, "list")[0], "emotion") == number


async def test_without_senses(bare_caller: Caller) -> None:
    assert Hearing not in bare_caller.robot
    for name, args in (
        ("gesture.recognized", ()),
        ("skeleton.turn_on_recognition", (1, 1)),
        ("personnel.face_recognized", ([],)),
        ("train.training_words_recognized", ()),
    ):
        assert field(await bare_caller(f"cyberdog.{name}", *args), "state.code") == 1
