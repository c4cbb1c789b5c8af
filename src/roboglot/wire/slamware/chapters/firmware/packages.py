"""Packages that clients upload: zip archives with a description. Bounded before anything is unpacked.

The vendor's format of firmware is not public. Our firmware packages are zip archives with a file ``firmware.json``,
``{"version": "2.1.0", "model": "…", "modules": {"motion": "1.4"}, "notes": "…"}``, where only the version is
required; the other files are the firmware.
"""

from __future__ import annotations

import re
import struct
import zlib
from typing import Annotated, BinaryIO

import msgspec

from roboglot.validation import why_invalid

DIRECTORY_MAX = 4 << 20  # bytes of an archive's table of contents
ENTRY_MAX = 4 << 20  # bytes of a description, unpacked
PACKED_MAX = ENTRY_MAX + (64 << 10)  # bytes of one, packed: what cannot be packed grows by five bytes in 16 KB
TAIL = 22 + 0xFFFF  # bytes at the end of an archive that contain the offset of its table
DESCRIPTION = "firmware.json"
STORED, DEFLATED = 0, 8  # methods, Android's and every build tool's. bzip2 makes 600 MB of 366 bytes
ENCRYPTED = 1  # flag of an entry
END, ZIP64_END, ENTRY, LOCAL = b"PK\5\6", b"PK\6\7", b"PK\1\2", b"PK\3\4"
END_HEAD, ENTRY_HEAD, LOCAL_HEAD = struct.Struct("<12xII2x"), struct.Struct("<8xHH4xIII14xI"), struct.Struct("<26xHH")
NO_CONTROLS = r"^[^\x00-\x1f\x7f]*\Z"  # versions are shown in answers, logs and lines
Text = Annotated[str, msgspec.Meta(min_length=1, max_length=64, pattern=NO_CONTROLS)]


class BadPackage(ValueError):
    """Invalid package, with the reason."""


class FirmwareDescription(msgspec.Struct):
    """Content of ``firmware.json``; without a ``model`` it fits any."""

    version: Text
    model: Annotated[str, msgspec.Meta(max_length=64)] = ""
    modules: Annotated[dict[Text, Text], msgspec.Meta(max_length=64)] = {}
    notes: Annotated[str, msgspec.Meta(max_length=10_000)] = ""


def read_firmware(file: BinaryIO) -> FirmwareDescription:
    """Return the description in a package. Raises BadPackage."""
    try:
        return msgspec.json.decode(entry_of(file, DESCRIPTION), type=FirmwareDescription)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise BadPackage(f"{DESCRIPTION}: {why_invalid(error, wanted=FirmwareDescription)}") from None


def entry_of(file: BinaryIO, name: str) -> bytes:
    """Return an unpacked file of a zip archive. Raises BadPackage if it is missing, too large or damaged.

    The table is searched as text and the other files stay unread: the library would make an object of each, which
    takes seconds, and believe whatever size a zip64 archive gives for its table.
    """
    try:
        begin, table = _directory(file)
        flags, method, checksum, packed, size, offset = ENTRY_HEAD.unpack_from(table, _place(table, name.encode()))
        if flags & ENCRYPTED:
            raise BadPackage(f"its {name} is encrypted")
        if method not in (STORED, DEFLATED):
            raise BadPackage(f"its {name} is compressed with another method than deflate")
        if size > ENTRY_MAX or packed > PACKED_MAX:
            raise BadPackage(f"its {name} is too long")
        data = _content(file, begin + offset, packed, method)
    except (struct.error, zlib.error, OSError) as error:
        raise BadPackage(f"the zip archive is damaged: {error}") from None
    if len(data) > ENTRY_MAX:
        raise BadPackage(f"its {name} is too long")
    if len(data) != size or zlib.crc32(data) != checksum:
        raise BadPackage(f"the zip archive is damaged: its {name} is not what its table says")
    return data


def _directory(file: BinaryIO) -> tuple[int, bytes]:
    """Return the archive's begin in the file, which may have something before it, and its table of contents."""
    size = file.seek(0, 2)
    file.seek(max(0, size - TAIL))
    tail = file.read(TAIL)
    end = tail.rfind(END)
    if end < 0:
        raise BadPackage("it is not a zip archive")
    if ZIP64_END in tail[max(0, end - 20) : end]:
        raise BadPackage("it is a zip64 archive, which only archives above 4 GB have to be")
    length, offset = END_HEAD.unpack_from(tail, end)
    if length > DIRECTORY_MAX:
        raise BadPackage("its table of contents is too long")
    at = size - len(tail) + end - length
    if at < offset:
        raise BadPackage("the zip archive is damaged: its table of contents is incomplete")
    file.seek(at)
    return at - offset, file.read(length)


def _place(table: bytes, name: bytes) -> int:
    """Return where in the table the file's entry begins."""
    head = re.escape(ENTRY) + b".{24}" + re.escape(len(name).to_bytes(2, "little")) + b".{16}"
    found = re.finditer(head + re.escape(name), table, re.DOTALL)
    first = next(found, None)
    if first is None:
        raise BadPackage(f"it has no {name.decode()}")
    if next(found, None) is not None:
        raise BadPackage(f"it has two files {name.decode()}")
    return first.start()


def _content(file: BinaryIO, at: int, packed: int, method: int) -> bytes:
    """Return the content of the file that begins at ``at``, cut off above ENTRY_MAX bytes."""
    file.seek(at)
    head = file.read(LOCAL_HEAD.size)
    if not head.startswith(LOCAL):
        raise BadPackage("the zip archive is damaged: its table of contents points elsewhere")
    file.seek(at + LOCAL_HEAD.size + sum(LOCAL_HEAD.unpack_from(head)))
    data = file.read(packed)
    return data if method == STORED else zlib.decompressobj(-zlib.MAX_WBITS).decompress(data, ENTRY_MAX + 1)
