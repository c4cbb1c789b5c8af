"""Cuts a byte stream into command texts at ``;``. Bounded; does not know the texts' meaning."""

from __future__ import annotations

from collections.abc import Iterator

LINE_MAX = 1024  # bytes of one command, without its `;`
END = b";"


class LineSplitter:
    """Splits a stream into lines and keeps the unfinished tail between two reads."""

    __slots__ = ("_overlong", "_tail")

    def __init__(self) -> None:
        self._tail = b""
        self._overlong = False

    @property
    def pending(self) -> int:
        """Number of bytes kept until the next ``;``, at most LINE_MAX."""
        return len(self._tail)

    @property
    def within(self) -> bool:
        """Return whether a text has begun that ends later, even one that is too long to be kept."""
        return self._overlong or bool(self._tail)

    @property
    def begun(self) -> str:
        """The text that has begun and not ended, as far as it is kept."""
        return self._tail.decode(errors="replace").strip()

    def feed(self, data: bytes) -> Iterator[str | None]:
        """Yield every text that ``data`` completes, without surrounding white space; skip empty texts.

        None stands for a text longer than LINE_MAX, which was dropped. Bytes that aren't UTF-8 become U+FFFD.
        """
        *complete, tail = data.split(END)
        for part in complete:
            if (not part or part.isspace()) and not (self._tail or self._overlong):  # quickly: they may be a flood
                continue
            text = self._finish(part)
            if text != "":
                yield text
        self._keep(tail)

    def flush(self) -> str | None:
        """Return the pending text without its ``;`` (None if too long), for clients that never send one."""
        return self._finish(b"")

    def _finish(self, part: bytes) -> str | None:
        self._keep(part)
        whole, overlong = self._tail, self._overlong
        self._tail, self._overlong = b"", False
        return None if overlong else whole.decode(errors="replace").strip()

    def _keep(self, part: bytes) -> None:
        if not part:
            return
        if self._overlong or len(self._tail) + len(part) > LINE_MAX:
            self._tail, self._overlong = b"", True
        else:
            self._tail += part
