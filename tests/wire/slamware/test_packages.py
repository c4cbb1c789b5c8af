"""Uploaded packages: what is in them, and that nothing hostile gets further than BadPackage."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zipfile

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.slamware.chapters.firmware.apk import Apk, parse_manifest, read_apk
from roboglot.wire.slamware.chapters.firmware.packages import DIRECTORY_MAX, ENTRY_MAX, BadPackage, read_firmware
from tests.wire.slamware.manifest import archive, manifest


@pytest.mark.parametrize("wide", [False, True])
def test_name_and_version_of_an_app(wide: bool) -> None:
    package = archive(classes__dex=b"x" * 100, AndroidManifest__xml=manifest("com.example.餐", "1.2.3", wide=wide))
    assert read_apk(io.BytesIO(package)) == Apk("com.example.餐", "1.2.3")
    assert parse_manifest(manifest("org.x", number=12, wide=wide)) == Apk("org.x", "12")


def test_firmware_packages_are_described() -> None:
    text = b'{"version": "2.1.0", "model": "Hermes", "modules": {"motion": "1.4"}}'
    found = read_firmware(io.BytesIO(archive(firmware__json=text, image__bin=b"\0" * 1000)))
    assert (found.version, found.model, found.modules) == ("2.1.0", "Hermes", {"motion": "1.4"})


@pytest.mark.parametrize(
    "package",
    [
        b"",
        b"nothing like it",
        b"PK\5\6" + b"\xff" * 18,
        archive(other=b"x"),
        archive(firmware__json=b"{}"),
        archive(firmware__json=b'{"version": ""}'),
        archive(firmware__json=b'{"version": "1", "notes": "' + b" " * (ENTRY_MAX + 1) + b'"}'),  # a zip bomb
        archive(firmware__json=b"[" * 100_000),
    ],
)
def test_no_firmware(package: bytes) -> None:
    with pytest.raises(BadPackage):
        read_firmware(io.BytesIO(package))


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_usual_packages_are_read(method: int) -> None:
    assert read_firmware(io.BytesIO(archive(method, firmware__json=b'{"version": "1"}'))).version == "1"


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_bombs_of_other_methods_stay_packed(method: int) -> None:
    package = io.BytesIO(archive(method, firmware__json=b" " * 2 * ENTRY_MAX))
    tracemalloc.start()
    try:
        with pytest.raises(BadPackage, match="another method"):
            read_firmware(package)
        assert tracemalloc.get_traced_memory()[1] < ENTRY_MAX
    finally:
        tracemalloc.stop()


def _end(size: int) -> bytes:
    return b"PK\5\6" + bytes(8) + struct.pack("<IIH", size, 0, 0)


def _zip64_end(size: int) -> bytes:
    end = struct.pack("<4sQ12x4Q", b"PK\6\6", 44, size // 46, size // 46, size, 0)
    return end + struct.pack("<4sIQI", b"PK\6\7", 0, size, 1)


@pytest.mark.parametrize(("size", "zip64"), [(DIRECTORY_MAX, False), (4 * DIRECTORY_MAX, True)])
def test_long_tables_take_little_memory(size: int, zip64: bool) -> None:
    table = (b"PK\1\2" + bytes(42)) * (size // 46)
    whole = table + (_zip64_end(len(table)) + _end(100) if zip64 else _end(len(table)))
    package = io.BytesIO(whole)
    tracemalloc.start()
    try:
        with pytest.raises(BadPackage):
            read_firmware(package)
        assert tracemalloc.get_traced_memory()[1] < 2 * DIRECTORY_MAX
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("place", "value", "why"),
    [(-22 - 59 + 8, 1, "encrypted"), (-22 - 59 + 16, 0, "damaged"), (-22 - 59 + 24, 1, "damaged"), (0, 0, "damaged")],
)
def test_entries_are_what_the_table_says(place: int, value: int, why: str) -> None:
    data = bytearray(archive(firmware__json=b'{"version": "1"}'))
    data[place] = value
    with pytest.raises(BadPackage, match=why):
        read_firmware(io.BytesIO(data))


def test_a_name_given_twice_is_refused() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as target:
        target.writestr("firmware.json", b'{"version": "1"}')
        with pytest.warns(UserWarning, match="Duplicate"):
            target.writestr("firmware.json", b'{"version": "2"}')
    with pytest.raises(BadPackage, match="two files"):
        read_firmware(file)


def test_manifests_after_endless_chunks_are_refused() -> None:
    whole = manifest("com.example", "1")
    with pytest.raises(BadPackage, match="no element"):
        parse_manifest(whole[:8] + struct.pack("<HHI", 0, 8, 8) * 1000 + whole[8:])


@given(st.binary(max_size=400), st.integers(0, 400))
def test_damaged_manifests(noise: bytes, at: int) -> None:
    data = bytearray(manifest("com.example", "1"))
    data[at : at + len(noise)] = noise
    try:
        parse_manifest(bytes(data))
    except BadPackage:
        return


@pytest.mark.slow
@given(st.binary(max_size=200), st.integers(0, 600))
def test_damaged_archives(noise: bytes, at: int) -> None:
    data = bytearray(archive(AndroidManifest__xml=manifest("com.example", "1")))
    data[at : at + len(noise)] = noise
    try:
        read_apk(io.BytesIO(data))
    except BadPackage:
        return
