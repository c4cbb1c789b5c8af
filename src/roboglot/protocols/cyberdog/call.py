"""One request under way, and its streamed answers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TypeVar

from roboglot.operations import BadParameters
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.stream import Stream
from roboglot.values import dataclass
from roboglot.wire.cyberdog.codes import Accepted, InBandError

Answer = TypeVar("Answer")


@dataclass(slots=True)  # not frozen: one is created for every request, and frozen ones take four times as long
class Call:
    """One request under way.

    A handler returns the answer (a dict as JSON, a str as it is, None for nothing more); longer work may send any
    number of answers by ``reply`` before.
    """

    code: int
    text: str  # the raw params
    context: Context
    reply: Callable[[object], Awaitable[None]]
    why: str = ""  # the reason for a refusal, in plain words
    began: float | None = None  # robot time at which the tap noted the request
    misspelt: Mapping[str, str] | None = None  # why unknown names were ignored, by the fields that they probably mean

    def refused(self, answer: Answer, why: str) -> Answer:
        """Return ``answer``, a refusal; ``why`` is for the log and for viewers of the exchange."""
        self.why = why
        return answer

    def check_spelling(self, *fields: str) -> None:
        """Raise BadParameters if one of these is misspelt: without it, more would be done than was asked."""
        misspelt = self.misspelt or {}
        for field in fields:
            if field in misspelt:
                raise BadParameters(misspelt[field])


async def follow(call: Call, stream: Stream, seconds: float) -> object:
    """Stream the answers from acceptance to result; ends early when another call joins or the app is lost.

    If the result takes longer than ``seconds``, the last answer is a time-out.
    """
    reader = stream.attach()

    async def pass_on() -> None:
        await call.reply({"accepted": int(Accepted.YES)})
        while (message := await reader.get()) is not None:
            await call.reply(message)

    try:
        await call.context.robot.clock.wait_for(pass_on(), seconds)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    finally:
        stream.detach(reader)
    return None
