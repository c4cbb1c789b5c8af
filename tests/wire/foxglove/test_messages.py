"""Any bytes are read or refused in words; what the protocol's description shows byte for byte is so."""

from __future__ import annotations

import contextlib
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.wire.foxglove.messages import (
    Malformed,
    Playback,
    Request,
    asset_failure,
    message,
    message_data,
    playback_state,
    read_request,
    time_message,
)

BINARY = st.builds(lambda opcode, rest: bytes([opcode]) + rest, st.integers(0, 4), st.binary(max_size=40))


@settings(max_examples=60)
@given(st.one_of(st.text(max_size=40), BINARY))
def test_anything_is_read_or_refused(data: str | bytes) -> None:
    with contextlib.suppress(Malformed):
        assert isinstance(read_request(data), Request)


@given(st.integers(0, 2**32 - 1), st.binary())
def test_published_messages_are_read(channel: int, data: bytes) -> None:
    request = read_request(b"\x01" + channel.to_bytes(4, "little") + data)
    assert request == Request("messageData", {"channel": channel, "data": data})


@given(
    st.integers(0, 1),
    st.floats(width=32, allow_nan=False),
    st.none() | st.integers(0, 2**64 - 1),
    st.text(max_size=60),
)
def test_playback_requests_are_read(command: int, speed: float, seek: int | None, name: str) -> None:
    head = struct.pack("<BBfBQ", 3, command, speed, seek is not None, seek or 0)
    text = name.encode()
    values = read_request(head + struct.pack("<I", len(text)) + text).values
    assert values == {"command": command, "speed": speed, "seek": seek, "request": name}
    assert read_request(head).values["request"] == ""  # as early versions send it


def test_bytes_of_the_description() -> None:
    assert message_data(5, 7, b"x") == b"\x01\x05\0\0\0\x07\0\0\0\0\0\0\0x"
    assert time_message(258) == b"\x02\x02\x01\0\0\0\0\0\0"
    assert playback_state(Playback(1, 2, 1.0, request="q")) == b"\x05\x01\x02" + bytes(7) + b"\0\0\x80?\0\x01\0\0\0q"
    # Sent by foxglove-sdk 0.30.3, the vendor's own server, after seeking.
    vendors = bytes.fromhex("05 00 15cd5b0700000000 00000040 01 03000000 616263")
    assert playback_state(Playback(0, 123456789, 2.0, sought=True, request="abc")) == vendors
    assert asset_failure(3, "no") == b"\x04\x03\0\0\0\x01\x02\0\0\0no"
    assert message("status", level=2, id=None) == '{"op":"status","level":2}'


def test_a_service_call_is_read() -> None:
    values = read_request(b"\x02\x01\0\0\0\x02\0\0\0\x04\0\0\0json{}").values
    assert values == {"service": 1, "call": 2, "encoding": "json", "data": b"{}"}
    with pytest.raises(Malformed, match="too long"):
        read_request(b"\x02\x01\0\0\0\x02\0\0\0\xff\0\0\0json{}")
