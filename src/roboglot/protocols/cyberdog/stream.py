"""Feedback of work that takes long: one stream reads it at a time, and others may take it over. Knows no work."""

from __future__ import annotations

import asyncio

UNREAD_MAX = 64  # unread messages per reader, beyond which the oldest is dropped
Reader = asyncio.Queue[object]  # None ends it


class Stream:
    """Stream of feedback with at most one reader; a later reader takes it over.

    The same feedback twice in a row is sent once.
    """

    def __init__(self) -> None:
        self._last: object = None
        self._reader: Reader | None = None

    def send(self, feedback: object) -> None:
        """Send feedback to the reader; a later reader gets the latest first."""
        if feedback != self._last:
            self._last = feedback
            self._pass_on(feedback)

    def end(self, result: object) -> None:
        """Send the result and release the reader."""
        self._pass_on(result)
        self.unbind()

    def unbind(self) -> None:
        """End the reader's stream silently; the work continues."""
        self._pass_on(None)
        self._reader = None

    def attach(self) -> Reader:
        """Take over the stream; return a queue of the latest feedback and all that follows, up to the result."""
        self.unbind()
        self._reader = asyncio.Queue(UNREAD_MAX)
        if self._last is not None:
            self._pass_on(self._last)
        return self._reader

    def detach(self, reader: Reader) -> None:
        """Stop reading for ``reader``, whose client is gone."""
        if self._reader is reader:
            self._reader = None

    def _pass_on(self, message: object) -> None:
        if self._reader is None:
            return
        if self._reader.full():
            self._reader.get_nowait()
        self._reader.put_nowait(message)
