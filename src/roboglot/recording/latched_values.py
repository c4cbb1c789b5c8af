"""Latched values, recorded once or when they change (body, map, faults): the last one holds until the next."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.recording.entries import Entry

LATCHED = frozenset({"state", "battery", "lidar", "grid", "scene"})  # kinds whose last value holds until the next
LATCHED_MAX = 1000  # topics
REPEATED = 0  # the sequence number of messages repeated from an earlier part


class LatchedValues:
    """The last entry of each topic with latched values."""

    def __init__(self) -> None:
        self._last: dict[str, Entry] = {}

    def note(self, entry: Entry) -> None:
        """Keep an entry if its value is latched."""
        if entry.kind in LATCHED and (entry.topic in self._last or len(self._last) < LATCHED_MAX):
            self._last[entry.topic] = entry

    def at(self, at: int) -> Sequence[Entry]:
        """Return all entries with this time (ns since 1970)."""
        return [entry._replace(at=at) for entry in self._last.values()]
