"""Requests of all chapters: decoded answers, and errors as exceptions with the vendor's number and words."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Mapping
from contextlib import aclosing
from enum import IntEnum
from typing import Any, TypeVar

import msgspec

from roboglot.clients.cyberdog.link import DogLink
from roboglot.clients.errors import BadAnswer, ClientError, RefusedByRobot, TimedOut
from roboglot.model.clock import Clock
from roboglot.validation import read_answer
from roboglot.wire.cyberdog.codes import Code, InBandError

T = TypeVar("T")
TIMEOUT = 10.0  # s for an answer, unless the operation has its own
IN_BAND: Mapping[int, str] = {
    InBandError.TIMEOUT: "the robot's own service did not answer in time",
    InBandError.UNAVAILABLE: "the robot has no such service, or it is not running",
    InBandError.BAD_PARAMETERS: "the parameters are not what the robot expects",
}


class CyberDogRefused(RefusedByRobot):
    """``code``: the robot's number; ``operation``: the code's name."""


class NoAnswer(ClientError):
    """The robot ended the request without an answer: it does not know the code, or lacks its service."""


class _InBand(msgspec.Struct):
    error_code: int


class Calls:
    """Requests over one link."""

    def __init__(self, link: DogLink) -> None:
        self.link = link

    @property
    def clock(self) -> Clock:
        """Clock of the client."""
        return self.link.clock

    async def answers(self, code: Code, params: object = None) -> AsyncGenerator[str, None]:
        """Yield all answers of a request as they arrive. Raises CyberDogRefused for an error among them, LinkLost."""
        async for name, text in self.link.send(code, _text(params)):
            if '"error_code"' in text:
                number = decode(text, _InBand, code).error_code
                raise CyberDogRefused(code.name, number, IN_BAND.get(number, "unknown"))
            if name == code or name == 0 or code is Code.UPDATE_PROGRESS:  # whose answers have another code
                yield text

    async def text(self, code: Code, params: object = None, *, within: float = TIMEOUT) -> str:
        """Return the first answer. Raises NoAnswer, TimedOut after ``within`` s, and like ``answers``."""

        async def first() -> str:
            async for text in self.answers(code, params):
                return text
            raise NoAnswer(f"{code.name}: the robot answered nothing")

        try:
            return await self.clock.wait_for(first(), within)
        except TimeoutError:
            raise TimedOut(f"{code.name}: no answer within {within:g} s") from None

    async def ask(self, code: Code, kind: type[T], params: object = None, *, within: float = TIMEOUT) -> T:
        """Return the first answer, decoded. Raises BadAnswer, and like ``text``."""
        return decode(await self.text(code, params, within=within), kind, code)

    async def parts(self, code: Code, kind: type[T], params: object = None) -> AsyncGenerator[T, None]:
        """Yield all answers as they arrive, decoded. Raises BadAnswer, and like ``answers``."""
        async with aclosing(self.answers(code, params)) as answers:
            async for text in answers:
                yield decode(text, kind, code)

    async def do(self, code: Code, params: object = None, *, within: float = TIMEOUT) -> None:
        """Send a request with an answer of ``success``, ``result`` or nothing. Raises CyberDogRefused."""
        text = await self.text(code, params, within=within)
        check(code, decode(text, dict, code) if text else {})


def check(code: Code, answer: Mapping[str, Any], words: type[IntEnum] | None = None) -> None:
    """Raise CyberDogRefused unless ``answer`` means success; ``words``: names of the answer's numbers."""
    for key in ("success", "result", "response", "unlock_result"):
        value = answer.get(key)
        if value is None or value is True or (value == 0 and value is not False):
            continue
        said = answer.get("code", value)
        number = int(said) if isinstance(said, int | float) else 0
        name = str(answer.get("message", "")) or "the robot did not do it"
        if words and number in tuple(words):
            name = words(number).name.lower().replace("_", " ")
        raise CyberDogRefused(code.name, number, name)


def _text(params: object) -> str:
    return params if isinstance(params, str) else msgspec.json.encode({} if params is None else params).decode()


def decode(text: str, kind: type[T], code: Code) -> T:
    """Return a decoded answer to ``code``. Raises BadAnswer."""
    try:
        return read_answer(text.encode(), kind)
    except msgspec.MsgspecError as error:
        raise BadAnswer(f"{code.name}: {error}: {text[:200]}") from None
