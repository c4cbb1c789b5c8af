"""Foreign text for a terminal, with characters that move the cursor, colour or reorder text as escapes; and for XML."""

from __future__ import annotations

import logging
import re

from roboglot.spelling import brief

LINE_MAX = 2000  # characters of a log line's message
TRACEBACK_MAX = 20_000  # characters of a line with its traceback
_KEPT = "\t\n"
_REORDERING = (0x061C, 0x200E, 0x200F, 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
_CONTROLS = (*range(0x20), *range(0x7F, 0xA0))
_WRITTEN_OUT = {
    code: f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"
    for code in (*_CONTROLS, *_REORDERING)
    if chr(code) not in _KEPT
}
_NOT_XML = "[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"  # characters that XML 1.0 lacks


def visible(text: str) -> str:
    """Return ``text`` with control characters and direction marks as escapes; line ends and tabs stay."""
    return text.translate(_WRITTEN_OUT).encode("utf-8", "replace").decode()


def in_line(text: str) -> str:
    """Return ``text`` as ``visible`` does, in one line: it begins no row of its own."""
    return visible(text).replace("\n", "\\n")


def xml_text(text: str) -> str:
    """Return ``text`` with characters that XML cannot hold replaced."""
    return re.sub(_NOT_XML, "\ufffd", text)


class VisibleFormatter(logging.Formatter):
    """Escapes log lines, so that no text of clients and programs reaches the terminal as a command, and bounds them.

    The system's errors lose their numbers.
    """

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - logging's name
        """Return the line without its traceback."""
        record.message = brief(record.message, LINE_MAX)
        return re.sub(r"\[Errno -?\d+\] ", "", super().formatMessage(record))

    def format(self, record: logging.LogRecord) -> str:
        """Return the line, escaped; of a long traceback, its end."""
        text = super().format(record)
        if len(text) > TRACEBACK_MAX:
            text = f"{text[: 2 * LINE_MAX]}\n…\n{text[2 * LINE_MAX - TRACEBACK_MAX :]}"
        return visible(text)
