"""Cuts an H.264 Annex B byte stream into access units: one picture each. Knows no decoder and no socket."""

from __future__ import annotations

import re
from collections.abc import Iterator

from roboglot.values import dataclass

ACCESS_UNIT_MAX = 4 << 20  # bytes; anything longer is not video
_START = re.compile(rb"\x00\x00\x01")
_SLICE, _KEY_SLICE = 1, 5
_HEADS = frozenset({6, 7, 8, 9})  # SEI, SPS, PPS, delimiter: before a picture's first slice


@dataclass(frozen=True, slots=True)
class AccessUnit:
    """Bytes of one picture, with the parameter sets before it; ``keyframe``: a decoder can start here."""

    data: bytes
    keyframe: bool


class AccessUnitSplitter:
    """Splits a stream that is fed in pieces; a unit is complete when the next one begins, so one picture late."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._looked = 0  # offset before which start codes have been examined
        self._has_slice = self._keyframe = False

    def feed(self, data: bytes) -> Iterator[AccessUnit]:
        """Yield every unit that ``data`` completes. Raises ValueError beyond ACCESS_UNIT_MAX."""
        self._buffer += data
        at = self._looked
        while (found := _START.search(self._buffer, at)) and found.end() + 1 < len(self._buffer):
            start = found.start()
            kind, first = self._buffer[found.end()] & 31, self._buffer[found.end() + 1]
            is_slice = kind in (_SLICE, _KEY_SLICE)
            if self._has_slice and (kind in _HEADS or (is_slice and first & 0x80)):  # first_mb_in_slice is 0
                start -= start > 0 and self._buffer[start - 1] == 0  # the longer start code
                yield AccessUnit(bytes(self._buffer[:start]), self._keyframe)
                del self._buffer[:start]
                found_end = found.end() - start
                self._has_slice = self._keyframe = False
            else:
                found_end = found.end()
            self._has_slice |= is_slice
            self._keyframe |= kind == _KEY_SLICE
            at = found_end
        self._looked = max(at, len(self._buffer) - 4) if found is None else at
        if len(self._buffer) > ACCESS_UNIT_MAX:
            raise ValueError(f"a picture of more than {ACCESS_UNIT_MAX} bytes")
