"""Android packages: name and version of an app from the binary XML of its manifest. Runs no app.

The format is Android's ResourceTypes.h: a chunk of strings, one with the resource ids of attributes, then elements.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import BinaryIO

from roboglot.values import dataclass
from roboglot.wire.slamware.chapters.firmware.packages import BadPackage, entry_of

MANIFEST = "AndroidManifest.xml"
XML, STRINGS, RESOURCE_IDS, ELEMENT = 0x0003, 0x0001, 0x0180, 0x0102
UTF8 = 0x100  # flag of the strings
VERSION_CODE, VERSION_NAME = 0x0101021B, 0x0101021C  # resource ids of the attributes
TYPE_STRING, TYPES_INTEGER = 0x03, (0x10, 0x11)
ATTRIBUTES_MAX, TEXT_MAX = 200, 200
CHUNKS_MAX = 100  # before the first element, where build tools write four
HEADER = struct.Struct("<HHI")


@dataclass(frozen=True, slots=True)
class Apk:
    """An app; ``version``: its displayed version, or the version's number without one."""

    name: str
    version: str


def read_apk(file: BinaryIO) -> Apk:
    """Return name and version of a package. Raises BadPackage."""
    return parse_manifest(entry_of(file, MANIFEST))


def parse_manifest(data: bytes) -> Apk:
    """Return name and version in a binary manifest. Raises BadPackage."""
    try:
        return _parse(data)
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise BadPackage(f"the manifest is damaged: {error}") from None


def _parse(data: bytes) -> Apk:
    strings = _Strings()
    ids: tuple[int, ...] = ()
    for kind, chunk in _chunks(data):
        if kind == STRINGS:
            strings = _Strings(chunk)
        elif kind == RESOURCE_IDS:
            count = (len(chunk) - HEADER.size) // 4
            ids = struct.unpack_from(f"<{count}I", chunk, HEADER.size)
        elif kind == ELEMENT:
            return _manifest(chunk, strings, ids)
    raise BadPackage("the manifest has no element")


def _chunks(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the chunks within the outermost one."""
    kind, header, _ = HEADER.unpack_from(data)
    if kind != XML:
        raise BadPackage("the manifest is not binary XML")
    at = header
    for _ in range(CHUNKS_MAX):
        if at >= len(data):
            return
        kind, _, size = HEADER.unpack_from(data, at)
        if size < HEADER.size:
            raise BadPackage("a chunk of the manifest is too short")
        yield kind, data[at : at + size]
        at += size


class _Strings:
    """The manifest's strings, each decoded on demand, as many may share the same bytes."""

    def __init__(self, chunk: bytes = b"") -> None:
        self._chunk = chunk
        self._count = self._flags = self._start = self._table = 0
        if chunk:
            self._count, _, self._flags, self._start, _ = struct.unpack_from("<5I", chunk, HEADER.size)
            _, self._table, _ = HEADER.unpack_from(chunk)

    def __getitem__(self, number: int) -> str:
        if not 0 <= number < self._count:
            raise IndexError("there is no such string")
        (offset,) = struct.unpack_from("<I", self._chunk, self._table + 4 * number)
        read = _utf8 if self._flags & UTF8 else _utf16
        return read(self._chunk, self._start + offset)[:TEXT_MAX]


def _utf8(chunk: bytes, at: int) -> str:
    size = 0
    for _ in range(2):  # number of characters, number of bytes
        size = chunk[at]
        at += 1
        if size & 0x80:
            size = (size & 0x7F) << 8 | chunk[at]
            at += 1
    return chunk[at : at + size].decode("utf-8", "replace")


def _utf16(chunk: bytes, at: int) -> str:
    (size,) = struct.unpack_from("<H", chunk, at)
    if size & 0x8000:
        raise BadPackage("a string of the manifest is too long")
    return chunk[at + 2 : at + 2 + 2 * size].decode("utf-16-le", "replace")


def _manifest(chunk: bytes, strings: _Strings, ids: tuple[int, ...]) -> Apk:
    """Return the app in the attributes of the first element, which is the manifest."""
    _, name, start, width, count = struct.unpack_from("<iiHHH", chunk, 16)
    if strings[name] != "manifest" or count > ATTRIBUTES_MAX:
        raise BadPackage("the manifest begins with something else")
    package = version = number = ""
    for place in range(count):
        _, key, raw, _, _, kind, value = struct.unpack_from("<iiiHBBI", chunk, 16 + start + place * width)
        id = ids[key] if 0 <= key < len(ids) else 0
        text = strings[raw] if raw >= 0 else strings[value] if kind == TYPE_STRING else ""
        if key >= 0 and strings[key] == "package":
            package = text
        elif id == VERSION_NAME:
            version = text
        elif id == VERSION_CODE and kind in TYPES_INTEGER:
            number = str(value)
    if not package or not package.isprintable():
        raise BadPackage("the manifest names no package")
    return Apk(package, version or number)
