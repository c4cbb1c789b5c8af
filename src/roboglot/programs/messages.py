"""What a worker may say, checked: the host's end of the frame contents.

Every byte is hostile. Knows the shapes and the small limits; what follows from a message is the run's business.
"""

from __future__ import annotations

from typing import Any

import msgspec

from roboglot.programs.worker.values import unpack

NAME_MAX = 200
"""Characters of a call's or an error type's name."""
ARGUMENTS_MAX = 64
"""Arguments of one call, and as many with names."""


class ProtocolViolation(ValueError):
    """A frame no honest worker sends."""


class OutputMessage(msgspec.Struct, tag_field="t", tag="output", forbid_unknown_fields=True):
    """Printed text."""

    text: str


class CallMessage(msgspec.Struct, tag_field="t", tag="call", forbid_unknown_fields=True):
    """A host call; the values are packed."""

    id: int
    name: str
    args: list[Any]
    kwargs: dict[str, Any]

    def values(self) -> tuple[tuple[Any, ...], dict[str, Any]]:
        """The arguments, unpacked. Raises ProtocolViolation."""
        if len(self.args) > ARGUMENTS_MAX or len(self.kwargs) > ARGUMENTS_MAX:
            raise ProtocolViolation("too many arguments")
        try:
            args = tuple([unpack(value) for value in self.args])
            return args, {key: unpack(value) for key, value in self.kwargs.items()} if self.kwargs else {}
        except ValueError as error:
            raise ProtocolViolation(str(error)) from None


class FinishedMessage(msgspec.Struct, tag_field="t", tag="finished", forbid_unknown_fields=True):
    """The program ran to its end."""


class FailedMessage(msgspec.Struct, tag_field="t", tag="failed", forbid_unknown_fields=True):
    """The program ended with an error."""

    type: str
    message: str
    unit: int
    line: int


class CheckedMessage(msgspec.Struct, tag_field="t", tag="checked", forbid_unknown_fields=True):
    """The problems of a program (line, column, kind, English, Chinese), and which modules' functions it uses."""

    problems: list[tuple[int, int, str, str, str]]
    uses: list[str]


Message = OutputMessage | CallMessage | FinishedMessage | FailedMessage | CheckedMessage
_decoder: msgspec.json.Decoder[Message] = msgspec.json.Decoder(Message)


def decode(body: bytes) -> Message:
    """The message of a frame. Raises ProtocolViolation."""
    try:
        return _decoder.decode(body)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ProtocolViolation(f"not a message: {str(error)[:200]}") from None
