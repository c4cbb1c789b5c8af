"""Packages that clients upload: zip archives with a description. Bounded before anything is unpacked.

The vendor's format of firmware is not public. Our firmware packages are zip archives with a file ``firmware.json``,
``{"version": "2.1.0", "model": "…", "modules": {"motion": "1.4"}, "notes": "…"}``, where only the version is
required; the other files are the firmware.
"""

from __future__ import annotations

import zipfile
import zlib
from typing import Annotated, BinaryIO

import msgspec

from roboglot.validation import why_invalid

DIRECTORY_MAX = 4 << 20  # bytes of an archive's table of contents
ENTRY_MAX = 4 << 20  # bytes of a description, unpacked
TAIL = 22 + 0xFFFF  # bytes at the end of an archive that contain the offset of its table
DESCRIPTION = "firmware.json"
# Android's and every build tool's. The library unpacks the others without a bound: 366 bytes of bzip2 become 600 MB.
METHODS = frozenset({zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED})
Text = Annotated[str, msgspec.Meta(min_length=1, max_length=64)]


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
    """Return an unpacked file of a zip archive. Raises BadPackage if it is missing, too large or damaged."""
    file.seek(0, 2)
    size = file.tell()
    file.seek(max(0, size - TAIL))
    tail = file.read(TAIL)
    end = tail.rfind(b"PK\5\6")
    if end < 0 or len(tail) < end + 22:
        raise BadPackage("it is not a zip archive")
    if int.from_bytes(tail[end + 12 : end + 16], "little") > DIRECTORY_MAX:
        raise BadPackage("its table of contents is too long")
    try:
        with zipfile.ZipFile(file) as archive:
            if archive.getinfo(name).compress_type not in METHODS:
                raise BadPackage(f"its {name} is compressed with another method than deflate")
            with archive.open(name) as entry:
                data = entry.read(ENTRY_MAX + 1)
    except BadPackage:
        raise
    except KeyError:
        raise BadPackage(f"it has no {name}") from None
    except (zipfile.BadZipFile, zlib.error, RuntimeError, NotImplementedError, ValueError, OSError, EOFError) as error:
        raise BadPackage(f"the zip archive is damaged: {error}") from None
    if len(data) > ENTRY_MAX:
        raise BadPackage(f"its {name} is too long")
    return data
