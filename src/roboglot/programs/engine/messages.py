"""Messages of a worker, decoded and checked.

Every byte is hostile. Knows the messages' fields and their limits; the run acts on them.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Annotated

import msgspec

from roboglot.programs.worker.values import SEPARATORS_MAX, separators, unpacking
from roboglot.programs.worker.variables import NAME_MAX as VARIABLE_NAME_MAX
from roboglot.programs.worker.variables import TEXT_MAX, VARIABLES_MAX

NAME_MAX = 200
"""Characters of a call's or an error type's name."""
ARGUMENTS_MAX = 64
"""Most positional arguments of one call, and most keyword arguments."""
SHORT = 256
"""Largest frame, in bytes, whose cost is not measured: reading the clock twice would take as long."""
VALUES_MAX = SEPARATORS_MAX + 2  # including the brackets around the arguments


Plain = bool | int | float | str | None
VariableName = Annotated[str, msgspec.Meta(max_length=VARIABLE_NAME_MAX)]
VariableText = Annotated[str, msgspec.Meta(max_length=TEXT_MAX)]


class ProtocolViolation(ValueError):
    """A frame that no honest worker sends."""


class OutputMessage(msgspec.Struct, tag_field="t", tag="output", forbid_unknown_fields=True):
    """Printed text."""

    text: str


class CallMessage(msgspec.Struct, tag_field="t", tag="call", forbid_unknown_fields=True):
    """A host call; the values are packed and not yet decoded."""

    id: int
    name: str
    args: msgspec.Raw
    kwargs: msgspec.Raw

    def values(self) -> Generator[None, None, tuple[tuple[object, ...], dict[str, object]]]:
        """Unpack the arguments in steps. Raises ProtocolViolation, for too many values before the first is made."""
        if self.size > SEPARATORS_MAX and separators(bytes(self.args)) + separators(bytes(self.kwargs)) > VALUES_MAX:
            raise ProtocolViolation("more values than a call may have")
        args, kwargs = [], {}
        try:
            packed, named = _list(self.args), _dict(self.kwargs)
            if len(packed) > ARGUMENTS_MAX or len(named) > ARGUMENTS_MAX:
                raise ProtocolViolation("too many arguments")
            for value in packed:
                args.append(value if type(value) in _ALONE else (yield from unpacking(value)))  # noqa: PERF401 - it yields
            for key, value in named.items():
                kwargs[key] = value if type(value) in _ALONE else (yield from unpacking(value))
        except (ValueError, msgspec.MsgspecError, RecursionError) as error:
            raise ProtocolViolation(str(error)[:200]) from None
        return tuple(args), kwargs

    @property
    def size(self) -> int:
        """Bytes of the arguments."""
        return len(self.args) + len(self.kwargs)


class PlainCall(msgspec.Struct, tag_field="t", tag="call", forbid_unknown_fields=True):
    """A short host call whose arguments contain no others, which is usual: they are what they stand for."""

    id: int
    name: str
    args: Annotated[tuple[Plain, ...], msgspec.Meta(max_length=ARGUMENTS_MAX)]
    kwargs: Annotated[dict[str, Plain], msgspec.Meta(max_length=ARGUMENTS_MAX)]


class VariablesMessage(msgspec.Struct, tag_field="t", tag="variables", forbid_unknown_fields=True):
    """Values of a watched program's variables, as text."""

    variables: Annotated[dict[VariableName, VariableText], msgspec.Meta(max_length=VARIABLES_MAX)]


class FinishedMessage(msgspec.Struct, tag_field="t", tag="finished", forbid_unknown_fields=True):
    """The program ran to its end."""


class FailedMessage(msgspec.Struct, tag_field="t", tag="failed", forbid_unknown_fields=True):
    """The program ended with an error."""

    type: str
    message: str
    unit: int
    line: int


class CheckedMessage(msgspec.Struct, tag_field="t", tag="checked", forbid_unknown_fields=True):
    """Problems of a program (line, column, kind, English, Chinese), and the modules' functions that it uses."""

    problems: list[tuple[int, int, str, str, str]]
    uses: list[str]


_Tagged = OutputMessage | CallMessage | VariablesMessage | FinishedMessage | FailedMessage | CheckedMessage
Message = _Tagged | PlainCall
_decoder: msgspec.json.Decoder[_Tagged] = msgspec.json.Decoder(_Tagged)
_ALONE = {bool, float, str, type(None)}  # types whose values are sent unpacked
_CALL = b'{"t":"call"'  # begins an intact worker's call
_decode_plain = msgspec.json.Decoder(PlainCall).decode
_list = msgspec.json.Decoder(list).decode
_dict = msgspec.json.Decoder(dict).decode


def decode(body: bytes) -> Message:
    """Return the message of a frame. Raises ProtocolViolation."""
    try:
        if len(body) <= SHORT and body.startswith(_CALL):  # it has no room for a number that is too large
            return _decode_plain(body)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        pass  # it may contain others
    try:
        return _decoder.decode(body)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ProtocolViolation(f"not a message: {str(error)[:200]}") from None
