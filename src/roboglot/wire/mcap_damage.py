"""Errors of reading an MCAP file that is damaged or truncated: its writer was killed, or still writes."""

import struct

import zstandard
from mcap.exceptions import McapError

RECORD_MAX = 1 << 30  # most bytes of a record that are read
# The first is the format's own; the others come from damaged bytes.
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
