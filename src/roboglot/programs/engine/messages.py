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
VALUES_MAX = SEPARATORS_MAX + 2  # including the brackets around the arguments


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

    def plain(self) -> tuple[tuple[object, ...], dict[str, object]] | None:
        """Return the arguments of a short call if all are positional and none contains others, which is usual.

        None for all other arguments, and for what is no list: ``values`` checks them.
        """
        if bytes(self.kwargs) != b"{}":
            return None
        try:
            packed = _list(self.args)
        except (msgspec.MsgspecError, ValueError, RecursionError):
            return None
        if len(packed) > ARGUMENTS_MAX or not _PLAIN.issuperset(map(type, packed)):
            return None
        return tuple(packed), {}

    @property
    def size(self) -> int:
        """Bytes of the arguments."""
        return len(self.args) + len(self.kwargs)


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


Message = OutputMessage | CallMessage | VariablesMessage | FinishedMessage | FailedMessage | CheckedMessage
_decoder: msgspec.json.Decoder[Message] = msgspec.json.Decoder(Message)
_ALONE = {bool, float, str, type(None)}  # types whose values are sent unpacked
_PLAIN = _ALONE | {int}  # a short call has no room for a number that is too large
_list = msgspec.json.Decoder(list).decode
_dict = msgspec.json.Decoder(dict).decode


def decode(body: bytes) -> Message:
    """Return the message of a frame. Raises ProtocolViolation."""
    try:
        return _decoder.decode(body)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ProtocolViolation(f"not a message: {str(error)[:200]}") from None
