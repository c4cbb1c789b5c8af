"""Writes Android packages as small as they can be: what a build tool's binary manifest holds, and nothing else."""

from __future__ import annotations

import io
import struct
import zipfile

IDS = (0x0101021B, 0x0101021C)  # versionCode, versionName


def _chunk(kind: int, header: bytes, body: bytes = b"") -> bytes:
    return struct.pack("<HHI", kind, 8 + len(header), 8 + len(header) + len(body)) + header + body


def _pool(strings: list[str], *, wide: bool) -> bytes:
    coded, offsets = b"", []
    for text in strings:
        offsets.append(len(coded))
        if wide:
            coded += struct.pack("<H", len(text)) + text.encode("utf-16-le") + b"\0\0"
        else:
            data = text.encode()
            coded += bytes([len(text), len(data)]) + data + b"\0"
    table = struct.pack(f"<{len(offsets)}I", *offsets)
    coded += b"\0" * (-len(coded) % 4)
    flags = 0 if wide else 0x100
    return _chunk(1, struct.pack("<5I", len(strings), 0, flags, 28 + len(table), 0), table + coded)


def manifest(package: str, version: str = "", number: int = 7, *, wide: bool = False) -> bytes:
    """Return a binary AndroidManifest.xml."""
    strings = ["versionCode", "versionName", "package", "manifest", package, version]
    attributes = [(0, -1, 0x10, number), (2, 4, 3, 4)]
    if version:
        attributes.insert(1, (1, 5, 3, 5))
    rows = b"".join(struct.pack("<iiiHBBI", -1, key, raw, 8, 0, kind, value) for key, raw, kind, value in attributes)
    element = struct.pack("<iiHHHHHH", -1, 3, 20, 20, len(attributes), 0, 0, 0) + rows
    body = _pool(strings, wide=wide)
    body += _chunk(0x0180, struct.pack("<2I", *IDS))
    body += _chunk(0x0102, struct.pack("<Ii", 1, -1), element)
    return struct.pack("<HHI", 3, 8, 8 + len(body)) + body


def archive(method: int = zipfile.ZIP_DEFLATED, /, **files: bytes) -> bytes:
    """Return a zip archive; double underscores in the names are dots."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", method) as zipped:
        for name, data in files.items():
            zipped.writestr(name.replace("__", "."), data)
    return target.getvalue()
