"""Reports the values of a watched program's variables as short text, at halts and before calls. Knows no robot.

Runs no code of the program: an object of the program's own class is shown by its type's name.
"""

from __future__ import annotations

import reprlib
import sys
import time
from collections.abc import Callable, Mapping
from types import BuiltinFunctionType, FrameType, FunctionType, ModuleType

UNIT = "<unit "
"""Prefix of the file names of the program's code objects."""
VARIABLES_MAX = 40
NAME_MAX, TEXT_MAX = 64, 160
"""Most characters of a name and of a value."""
PAUSE = 0.05
"""Least time between two reports before calls, in the machine's seconds; halts and block marks always report."""
MARKS = "block"
"""Suffix of the calls by which editors mark blocks, where the host may halt."""

_HIDDEN = (FunctionType, BuiltinFunctionType, ModuleType, type)
_PLAIN = frozenset({int, float, complex, bool, str, bytes, type(None), list, tuple, dict, set, frozenset, range})


class _Short(reprlib.Repr):
    """Shortened ``repr`` of plain values; for other values the type's name."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlist = self.maxtuple = self.maxdict = self.maxset = self.maxfrozenset = 8
        self.maxlevel, self.maxstring, self.maxlong = 4, 80, 60

    def repr1(self, x: object, level: int) -> str:
        return super().repr1(x, level) if type(x) in _PLAIN else f"<{type(x).__name__[:NAME_MAX]}>"


class Variables:
    """Reports variables to ``send``, without the host's own names, which are given to ``hide``."""

    def __init__(self, send: Callable[[dict[str, object]], None]) -> None:
        self._send = send
        self._short = _Short()
        self._own: frozenset[str] = frozenset()
        self._said: dict[str, str] = {}
        self._due = 0.0

    def hide(self, scope: Mapping[str, object]) -> None:
        """Omit these names from reports."""
        self._own = frozenset(scope)

    def before(self, call: Callable[..., object]) -> Callable[..., object]:
        """Return ``call`` with a report before it if the last report is old."""

        def reporting(name: str, /, *args: object, **kwargs: object) -> object:
            if name.endswith(MARKS) or time.monotonic() >= self._due:
                self.report()
            return call(name, *args, **kwargs)

        return reporting

    def report(self) -> None:
        """Send the variables of the program's innermost function and the globals, if they have changed."""
        frame: FrameType | None = sys._getframe(1)
        while frame is not None and not frame.f_code.co_filename.startswith(UNIT):
            frame = frame.f_back
        if frame is None:
            return
        self._due = time.monotonic() + PAUSE
        found = self._texts(frame.f_globals)
        if frame.f_locals is not frame.f_globals:
            found |= self._texts(frame.f_locals)
        found = dict(list(found.items())[-VARIABLES_MAX:])
        if found != self._said:
            self._said = found
            self._send({"t": "variables", "variables": found})

    def _texts(self, scope: Mapping[str, object]) -> dict[str, str]:
        texts = {}
        for name, value in list(scope.items()):
            if name not in self._own and name[:1] not in "_$" and not isinstance(value, _HIDDEN):
                texts[name[:NAME_MAX]] = self._text(value)
        return texts

    def _text(self, value: object) -> str:
        try:
            return self._short.repr(value)[:TEXT_MAX]
        except (ValueError, RecursionError):  # a number with too many digits
            return f"<{type(value).__name__}>"
