"""Errors of reading an MCAP file that is damaged or cut off: its program was killed, or still writes."""

from __future__ import annotations

import struct

import zstandard
from mcap.exceptions import McapError

RECORD_MAX = 1 << 30  # bytes per record that are read
# The first is the format's own; the others come of bytes that are not what they should be.
DAMAGE = (
    McapError,
    struct.error,
    zstandard.ZstdError,
    ValueError,
    KeyError,
    EOFError,
    MemoryError,
    OverflowError,
)
