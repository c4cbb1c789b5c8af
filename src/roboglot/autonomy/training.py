"""Learns words by hearing them several times. Knows texts only; Hearing distinguishes sounds."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict

from roboglot.autonomy.navigation.base_actions import PERIOD
from roboglot.model.actions import Action
from roboglot.model.components.interaction.training_words import (
    REPEATS,
    TRAINING,
    TRIGGER_MAX,
    VALUE_MAX,
    WORDS_MAX,
    TrainedWord,
    TrainingWords,
)
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Expired, InvalidGoal, NotFound, Refused
from roboglot.model.robot import Robot

KEY = "training_words"
SECONDS_MAX = 300.0
KIND_MAX = 32  # characters


class HeardWords(TrainingWords):
    """Trained words, kept as one list in the settings."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._turn = asyncio.Lock()  # of changes: each begins with the list that the one before stored

    def all(self) -> Sequence[TrainedWord]:
        return [TrainedWord(**row) for row in self._robot[Settings].get(KEY, [])]

    def teach(self, value: str, *, kind: str = "vp_task", seconds: float = 30.0, source: str = "") -> Action:
        _check(TrainedWord("x", value, kind))
        if not 0.0 < seconds <= SECONDS_MAX:
            raise InvalidGoal(f"the robot listens for up to {SECONDS_MAX:g} s, not {seconds}")
        clock = self._robot.clock

        async def run(action: Action) -> None:
            heard: Counter[str] = Counter()
            deadline = clock.time() + seconds
            with self._robot[Hearing].speech() as viewer:
                while clock.time() < deadline:
                    for speech in viewer.drain():
                        text = speech.text.strip()
                        if not 1 <= len(text) <= TRIGGER_MAX:
                            continue
                        heard[text] += 1
                        action.report(heard[text])
                        if heard[text] == REPEATS:
                            await self.learn(TrainedWord(text, value, kind))
                            return
                    await clock.sleep(PERIOD)
            raise Expired(f"no word was said {REPEATS} times in {seconds:g} s")

        return self._robot.actions.start("teach a word", run, resources=[TRAINING], goal=value, source=source)

    async def learn(self, word: TrainedWord) -> None:
        _check(word)
        async with self._turn:
            others = [known for known in self.all() if known.trigger != word.trigger]
            if len(others) >= WORDS_MAX:
                raise Refused(f"the robot knows {WORDS_MAX} words already")
            await self._keep([*others, word])

    async def forget(self, trigger: str) -> None:
        async with self._turn:
            words = self.all()
            left = [word for word in words if word.trigger != trigger]
            if len(left) == len(words):
                raise NotFound(f"{trigger!r} was never taught")
            await self._keep(left)

    async def _keep(self, words: list[TrainedWord]) -> None:
        await self._robot[Settings].put(KEY, [asdict(word) for word in words])


def _check(word: TrainedWord) -> None:
    if not (1 <= len(word.trigger.strip()) <= TRIGGER_MAX and len(word.value) <= VALUE_MAX):
        raise InvalidGoal(f"a word has 1 to {TRIGGER_MAX} characters, its meaning at most {VALUE_MAX}")
    if len(word.kind) > KIND_MAX:
        raise InvalidGoal(f"a kind has at most {KIND_MAX} characters")
