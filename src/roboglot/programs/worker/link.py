"""A program's one socket, seen from inside: frames out, replies in, one call at a time. Knows no names and no robot."""

from __future__ import annotations

import builtins
import json.encoder
import os
import re
import sys
from typing import Any

from roboglot.programs.language.names import EXCEPTIONS
from roboglot.programs.worker.environment import RobotError
from roboglot.programs.worker.frames import FRAME_MAX, FrameReader, frame
from roboglot.programs.worker.records import Records
from roboglot.programs.worker.values import SEPARATORS, SEPARATORS_MAX, pack, separators, unpack

REPLY_MAX = 16 * 1024 * 1024
"""Bytes of one frame from the host."""
TEXT_MAX = 128 * 1024
"""Characters of one output frame; longer text goes in pieces."""
HALT = "$halt"
"""What a watched program calls before a statement at which it is to halt; no program can write this name."""
EXIT_LOST, EXIT_MEMORY = 0, 71
"""Exit codes when the host has gone, and when memory runs out where nothing can be said any more."""

_READ = 64 * 1024
# The C encoder, built once: json's own wrapper builds it anew for each text; packed values contain nothing else.
_pieces = json.encoder.c_make_encoder(  # type: ignore[attr-defined]  # not in the type stubs
    None, None, json.encoder.encode_basestring, None, ":", ",", False, False, True
)
_scan = json.JSONDecoder().scan_once  # type: ignore[attr-defined]  # the host's messages have nothing around them
_quote = json.encoder.encode_basestring  # in C
_NOTHING = b'{"t":"value","value":null}'  # the answer to most calls
_TEXT = re.compile(r'"(?:[^"\\]|\\.)*"')
_ESCAPES = {character: f"\\u{character:04x}" for character in SEPARATORS}
_HEADROOM = 100
_SMALL = 1 << 63


class HostLink:
    """Sends output and calls; a call waits for its reply. When the host's end closes, the process ends."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._reader = FrameReader(REPLY_MAX)
        self._bodies: list[bytes] = []
        self._calls = 0
        self.records = Records({})

    def receive(self) -> dict[str, Any]:
        """The next message of the host."""
        message: dict[str, object] = _scan(self._body().decode(), 0)[0]
        return message

    def _body(self) -> bytes:
        while not self._bodies:
            data = os.read(self._descriptor, _READ)
            if not data:
                os._exit(EXIT_LOST)
            self._bodies = self._reader.feed(data)
        return self._bodies.pop(0)

    def send(self, message: dict[str, object]) -> None:
        """One message to the host; ValueError if it is too large. Lone surrogates become question marks."""
        self._send("".join(_pieces(message, 0)))

    def _send(self, text: str) -> None:
        body = text.encode("utf-8", "replace")
        if len(body) > FRAME_MAX:
            raise ValueError("the values are too large to be passed to the robot")
        data = frame(body)
        try:
            sent = os.write(self._descriptor, data)
            while sent < len(data):
                sent += os.write(self._descriptor, memoryview(data)[sent:])
        except (BrokenPipeError, ConnectionResetError):
            os._exit(EXIT_LOST)

    def write(self, text: str) -> None:
        """Text a program printed."""
        for start in range(0, len(text), TEXT_MAX):
            self.send({"t": "output", "text": text[start : start + TEXT_MAX]})

    def call(self, name: str, /, *args: object, **kwargs: object) -> object:
        """Ask the host; returns its value or raises its error."""
        limit = sys.getrecursionlimit()
        sys.setrecursionlimit(limit + _HEADROOM)  # a program at its depth limit must not fail in the middle of a call
        try:
            body = self._ask(name, args, kwargs)
            if body == _NOTHING:
                return None
            reply = _scan(body.decode(), 0)[0]
        finally:
            sys.setrecursionlimit(limit)
        if reply["t"] == "raise":
            raise _exception(reply["type"], reply["message"])
        return self.records.enrich(unpack(reply["value"], self.records.join))

    def _ask(self, name: str, args: tuple[object, ...], kwargs: dict[str, object]) -> bytes:
        packed, named = self._json(args) if args else "", self._json_named(kwargs) if kwargs else ""
        if len(packed) + len(named) > SEPARATORS_MAX:
            packed, named = _sparse(packed), _sparse(named)
            if (
                separators(packed.encode("utf-8", "replace")) + separators(named.encode("utf-8", "replace"))
                > SEPARATORS_MAX
            ):
                raise ValueError("more values than can be passed to the robot at once")
        self._calls += 1
        self._send(f'{{"t":"call","id":{self._calls},"name":{_quote(name)},"args":[{packed}],"kwargs":{{{named}}}}}')
        try:
            return self._body()
        except MemoryError:
            os._exit(EXIT_MEMORY)  # the reply is lost: program and host would be out of step from here on

    def _json(self, values: tuple[Any, ...]) -> str:
        """Most arguments are short numbers and texts: those are written without the detour over ``pack``."""
        texts = []
        for value in values:
            kind = type(value)
            if kind is int and -_SMALL < value < _SMALL:
                texts.append(repr(value))
            elif kind is str:
                texts.append(_quote(value))
            else:
                texts.append("".join(_pieces(pack(value, self.records.split), 0)))
        return ",".join(texts)

    def _json_named(self, values: dict[str, object]) -> str:
        return "".join(_pieces({key: pack(value, self.records.split) for key, value in values.items()}, 0))[1:-1]


def _sparse(values: str) -> str:
    """The same values, with separators between them only: inside of texts they are escaped, so that none counts."""
    return _TEXT.sub(lambda text: text[0].translate(_ESCAPES), values)


def _exception(name: str, message: str) -> BaseException:
    if name in EXCEPTIONS:
        known: type[BaseException] = getattr(builtins, name)
        return known(message)
    return RobotError(message) if name == "RobotError" else type(name, (RobotError,), {})(message)
