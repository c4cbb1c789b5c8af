"""The worker's end of a program's one socket: frames out, replies in, one call at a time. Knows no robot."""

from __future__ import annotations

import builtins
import json.encoder
import os
import re
import sys
from typing import Any

from roboglot.programs.language.names import EXCEPTIONS
from roboglot.programs.worker.environment import RobotError
from roboglot.programs.worker.frames import FRAME_MAX, HEADER, FrameReader, frame
from roboglot.programs.worker.records import Records
from roboglot.programs.worker.values import SEPARATORS, SEPARATORS_MAX, pack, separators, unpack

REPLY_MAX = 16 * 1024 * 1024
"""Most bytes of a frame from the host."""
TEXT_MAX = 128 * 1024
"""Most characters of an output frame; longer text is sent in pieces."""
HALT = "$halt"
"""Call by which a watched program halts before a statement; not a name that a program can use."""
NOTHING = frame(b'{"t":"value","value":null}')
"""Frame of the answer None, which most calls get."""
EXIT_LOST, EXIT_MEMORY = 0, 71
"""Exit codes when the host is gone, and when memory runs out where no report is possible."""

_READ = 64 * 1024
# The C encoder, built once, as json's own wrapper builds one per text; it covers all packed values.
_pieces = json.encoder.c_make_encoder(  # type: ignore[attr-defined]  # not in the type stubs
    None, None, json.encoder.encode_basestring, None, ":", ",", False, False, True
)
_scan = json.JSONDecoder().scan_once  # type: ignore[attr-defined]  # the host's messages have nothing around them
_quote = json.encoder.encode_basestring  # in C
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
        self._heads: dict[str, str] = {}  # of calls, by name
        self.records = Records({})

    def receive(self) -> dict[str, Any]:
        """Return the host's next message."""
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
        """Send a message to the host. Raises ValueError if it is too large. Lone surrogates become question marks."""
        self._send("".join(_pieces(message, 0)))

    def _send(self, text: str) -> None:
        data = frame(text.encode("utf-8", "replace"))
        size = len(data)
        if size > HEADER + FRAME_MAX:
            raise ValueError("the values are too large to be passed to the robot")
        try:
            sent = os.write(self._descriptor, data)
            while sent < size:
                sent += os.write(self._descriptor, memoryview(data)[sent:])
        except (BrokenPipeError, ConnectionResetError):
            os._exit(EXIT_LOST)

    def write(self, text: str) -> None:
        """Send text that the program printed."""
        for start in range(0, len(text), TEXT_MAX):
            self.send({"t": "output", "text": text[start : start + TEXT_MAX]})

    def call(self, name: str, /, *args: object, **kwargs: object) -> object:
        """Call the host; return its value or raise its error."""
        limit = sys.getrecursionlimit()
        sys.setrecursionlimit(limit + _HEADROOM)  # a program at its depth limit must not fail in the middle of a call
        try:
            body = self._ask(name, args, kwargs)
            if body is None:
                return None
            reply = _scan(body.decode(), 0)[0]
        finally:
            sys.setrecursionlimit(limit)
        if reply["t"] == "raise":
            raise _exception(reply["type"], reply["message"])
        return self.records.enrich(unpack(reply["value"], self.records.join))

    def _ask(self, name: str, args: tuple[Any, ...], kwargs: dict[str, object]) -> bytes | None:
        """Return the body of the answer; None for the answer None."""
        packed, named = "", self._json_named(kwargs) if kwargs else ""
        for value in args:  # short numbers and texts, the usual ones, bypass ``pack`` for speed
            kind = type(value)
            if kind is int and -_SMALL < value < _SMALL:
                text = repr(value)
            elif kind is str:
                text = _quote(value)
            else:
                text = "".join(_pieces(pack(value, self.records.split), 0))
            packed = f"{packed},{text}" if packed else text
        if len(packed) + len(named) > SEPARATORS_MAX:
            packed, named = _sparse(packed), _sparse(named)
            if (
                separators(packed.encode("utf-8", "replace")) + separators(named.encode("utf-8", "replace"))
                > SEPARATORS_MAX
            ):
                raise ValueError("more values than can be passed to the robot at once")
        self._calls += 1
        head = self._heads.get(name) or self._heads.setdefault(name, f',"name":{_quote(name)},"args":[')
        self._send(f'{{"t":"call","id":{self._calls}{head}{packed}],"kwargs":{{{named}}}}}')
        try:
            data = os.read(self._descriptor, _READ)
            if data == NOTHING:
                return None
            if not data:
                os._exit(EXIT_LOST)
            self._bodies = self._reader.feed(data)
            return self._body()
        except MemoryError:
            os._exit(EXIT_MEMORY)  # without the reply, program and host would be out of step

    def _json_named(self, values: dict[str, object]) -> str:
        return "".join(_pieces({key: pack(value, self.records.split) for key, value in values.items()}, 0))[1:-1]


def _sparse(values: str) -> str:
    """Return the values with the separators inside of texts escaped, so that only those between values count."""
    return _TEXT.sub(lambda text: text[0].translate(_ESCAPES), values)


def _exception(name: str, message: str) -> BaseException:
    if name in EXCEPTIONS:
        known: type[BaseException] = getattr(builtins, name)
        return known(message)
    return RobotError(message) if name == "RobotError" else type(name, (RobotError,), {})(message)
