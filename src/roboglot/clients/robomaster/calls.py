"""Base of all chapters of commands: sends a command, writes numbers and reads answers."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Sequence
from enum import StrEnum

from roboglot.clients.errors import BadAnswer
from roboglot.clients.robomaster.errors import RoboMasterRefused
from roboglot.wire.robomaster.replies import Reply
from roboglot.wire.robomaster.telemetry import number_of

ANSWER_SECONDS = 2.0  # for answers that come at once
MOTION_SECONDS = 65.0  # for answers that come at the end of a motion
REFUSALS = frozenset(Reply) - {Reply.OK, Reply.ALREADY_IN_SDK_MODE} | {"error"}

Ask = Callable[[str, float], Awaitable[str]]
Parameter = float | int | bool | str | StrEnum | None


class Chapter:
    """Commands of one chapter over ``ask``."""

    def __init__(self, ask: Ask) -> None:
        self._ask = ask

    async def _do(self, command: str, *words: Parameter, wait: bool | None = None, **parameters: Parameter) -> None:
        """Send it and expect ``ok``. Raises RoboMasterRefused, LinkLost, TimedOut, BadAnswer.

        ``wait`` adds ``wait_for_complete`` and gives it the time of a motion.
        """
        if wait is not None:
            parameters["wait_for_complete"] = wait
        text = spell(command, *words, **parameters)
        answer = await self._ask(text, MOTION_SECONDS if wait else ANSWER_SECONDS)
        if answer != Reply.OK:
            raise RoboMasterRefused(text, answer) if answer in REFUSALS else BadAnswer(f"{text}: {answer!r}")

    async def _words(self, command: str, count: int, **parameters: Parameter) -> Sequence[str]:
        """Send the query (its ``?`` is added) and return exactly ``count`` words."""
        text = f"{spell(command, **parameters)} ?"
        answer = await self._ask(text, ANSWER_SECONDS)
        if answer in REFUSALS:
            raise RoboMasterRefused(text, answer)
        words = answer.split()
        if len(words) != count:
            raise BadAnswer(f"{text}: {answer!r} instead of {count} values")
        return words

    async def _numbers(self, command: str, count: int, **parameters: Parameter) -> Sequence[float]:
        """Return the words of ``_words`` as numbers."""
        words = await self._words(command, count, **parameters)
        try:
            return [number_of(word) for word in words]
        except ValueError:
            raise BadAnswer(f"{command} ?: {' '.join(words)!r}") from None

    async def _number(self, command: str, **parameters: Parameter) -> float:
        return (await self._numbers(command, 1, **parameters))[0]


def spell(command: str, *words: Parameter, **parameters: Parameter) -> str:
    """Return the command's text: bare words, then parameters by name; those that are None are left out."""
    named = (f"{name} {_word(value)}" for name, value in parameters.items() if value is not None)
    return " ".join((command, *(_word(word) for word in words if word is not None), *named))


def on_off(on: bool | None) -> str | None:
    """Return the manual's word for a switch: "on" or "off"."""
    return None if on is None else "on" if on else "off"


def _word(value: Parameter) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{value} is not a finite number")
        return f"{value:.6f}".rstrip("0").rstrip(".")
    text = str(value)
    if not text or ";" in text or text.split() != [text]:
        raise ValueError(f"{text!r} is not one word")
    return text
