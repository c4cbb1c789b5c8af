"""Words are learnt by hearing them three times, and kept."""

import asyncio

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.interaction.training_words import WORDS_MAX, TrainedWord, TrainingWords
from roboglot.model.errors import Expired, InvalidGoal, NotFound, Refused
from roboglot.model.geometry import Pose


@pytest.mark.world("playground")
async def test_a_word_said_three_times(robot, world, forward):
    anna = world.stage.person("anna")
    anna.stand()
    anna.place(3.0, 5.5, 180)
    world.stage.place("a", Pose(1.5, 5.5))
    await forward(seconds=1)
    teaching = robot[TrainingWords].teach("wave_task")
    for text in ("hello", "abracadabra", "abracadabra"):
        anna.say(text)
    await forward(seconds=8)
    assert teaching.status is ActionStatus.EXECUTING
    assert robot[TrainingWords].all() == []
    anna.say("abracadabra")
    await forward(seconds=5)
    assert teaching.status is ActionStatus.SUCCEEDED
    assert robot[TrainingWords].all() == [TrainedWord("abracadabra", "wave_task")]


async def test_training_expires_without_speech(robot, forward):
    teaching = robot[TrainingWords].teach("x", seconds=2.0)
    await forward(seconds=3)
    assert isinstance(teaching.error, Expired)


async def test_known_words_can_be_replaced_and_forgotten(robot):
    words = robot[TrainingWords]
    for word in (TrainedWord("a", "1"), TrainedWord("b", "2"), TrainedWord("a", "3")):
        await words.learn(word)
    assert words.all() == [TrainedWord("b", "2"), TrainedWord("a", "3")]
    await words.forget("b")
    with pytest.raises(NotFound):
        await words.forget("b")
    with pytest.raises(InvalidGoal):
        await words.learn(TrainedWord(" ", "x"))
    for number in range(WORDS_MAX - 1):
        await words.learn(TrainedWord(f"w{number}", "x"))
    with pytest.raises(Refused):
        await words.learn(TrainedWord("one more", "x"))


async def test_words_taught_at_once_are_all_kept(robot, slow_settings):
    words = robot[TrainingWords]
    await words.learn(TrainedWord("old", "0"))
    await asyncio.gather(words.learn(TrainedWord("a", "1")), words.learn(TrainedWord("b", "2")), words.forget("old"))
    assert words.all() == [TrainedWord("a", "1"), TrainedWord("b", "2")]
