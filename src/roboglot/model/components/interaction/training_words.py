"""Words that people teach the robot, with their meanings."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.values import dataclass

TRAINING = "training"  # the resource that teaching holds
WORDS_MAX = 100
TRIGGER_MAX, VALUE_MAX = 64, 64  # characters
REPEATS = 3  # utterances of a word needed to learn it


@dataclass(frozen=True, slots=True)
class TrainedWord:
    """``trigger``: the spoken word; ``value``: its meaning; ``kind``: the meaning's type ("vp_task")."""

    trigger: str
    value: str
    kind: str = "vp_task"


class TrainingWords(Component):
    """Built on Hearing and Settings; learnt words survive restarts."""

    @abstractmethod
    def all(self) -> Sequence[TrainedWord]:
        """Words in the order in which they were learnt."""

    @abstractmethod
    def teach(self, value: str, *, kind: str = "vp_task", seconds: float = 30.0, source: str = "") -> Action:
        """Listen until the same utterance was heard REPEATS times; from then on it triggers ``value``.

        Feedback: times it was heard. Raises InvalidGoal; aborts with Expired when nothing was said often enough in
        time, Refused when the robot knows WORDS_MAX words.
        """

    @abstractmethod
    async def learn(self, word: TrainedWord) -> None:
        """Add a word without hearing it, replacing one with the same trigger. Raises InvalidGoal or Refused."""

    @abstractmethod
    async def forget(self, trigger: str) -> None:
        """Delete a word. Raises NotFound."""
