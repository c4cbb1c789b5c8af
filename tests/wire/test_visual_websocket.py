"""The WebSocket's bytes: what the standard's own examples say, and that nothing from outside breaks the reader."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.visual.websocket import (
    MESSAGE_MAX,
    Broken,
    Message,
    MessageReader,
    Opcode,
    accept_of,
    encode,
    goodbye,
    parse_opening,
    request_opening,
)


def read(data: bytes, *, masked: bool = False) -> list[Message]:
    return list(MessageReader(masked=masked).feed(data))


def test_the_standards_examples() -> None:  # RFC 6455, 1.3 and 5.7
    assert accept_of("dGhlIHNhbXBsZSBub25jZQ==") == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo="
    assert read(bytes.fromhex("810548656c6c6f")) == [Message(Opcode.TEXT, b"Hello")]
    assert read(bytes.fromhex("818537fa213d7f9f4d5158"), masked=True) == [Message(Opcode.TEXT, b"Hello")]
    assert read(bytes.fromhex("010348656c80026c6f")) == [Message(Opcode.TEXT, b"Hello")]
    assert read(bytes.fromhex("890548656c6c6f")) == [Message(Opcode.PING, b"Hello")]
    assert encode(Opcode.TEXT, b"Hello") == bytes.fromhex("810548656c6c6f")
    assert encode(Opcode.BINARY, b"x" * 256)[:4] == bytes.fromhex("827e0100")
    assert encode(Opcode.BINARY, b"x" * 65536)[:10] == bytes.fromhex("827f0000000000010000")


def test_a_control_frame_may_come_between_the_pieces_of_a_text() -> None:
    data = bytes.fromhex("010348656c") + encode(Opcode.PING, b"?") + bytes.fromhex("80026c6f")
    assert read(data) == [Message(Opcode.PING, b"?"), Message(Opcode.TEXT, b"Hello")]


@given(st.lists(st.binary(max_size=70_000), max_size=4), st.booleans(), st.integers(1, 5000))
def test_what_one_end_writes_the_other_reads_in_any_slices(texts: list[bytes], masked: bool, step: int) -> None:
    data = b"".join(encode(Opcode.TEXT, text, masked=masked) for text in texts)
    reader = MessageReader(masked=masked)
    found = [message.data for at in range(0, len(data), step) for message in reader.feed(data[at : at + step])]
    assert found == texts


@pytest.mark.parametrize(
    ("data", "code"),
    [
        ("8185", 1002),  # masked where none belongs
        ("c100", 1002),  # a reserved bit
        ("8300", 1002),  # no such kind
        ("8000", 1002),  # the rest of nothing
        ("0101610100", 1002),  # a text begins within a text
        ("0900", 1002),  # a ping in pieces
        ("897e0080", 1002),  # a long ping
        ("827fffffffffffffffff", 1009),
    ],
)
def test_what_breaks_the_rules_is_told_by_its_code(data: str, code: int) -> None:
    with pytest.raises(Broken) as caught:
        read(bytes.fromhex(data))
    assert caught.value.code == code


def test_pieces_add_up_to_the_same_limit() -> None:
    reader = MessageReader(masked=False)
    half = b"\x01" + encode(Opcode.TEXT, bytes(MESSAGE_MAX // 2 + 1))[1:]
    assert list(reader.feed(half)) == []
    with pytest.raises(Broken, match="at most"):
        list(reader.feed(b"\x00" + half[1:]))


def test_a_text_that_is_no_utf8_and_a_goodbye_that_is_too_long() -> None:
    with pytest.raises(Broken, match="UTF-8"):
        _ = Message(Opcode.TEXT, b"\xff").text
    assert goodbye(1000, "é" * 200)[2:].decode() == "é" * 61


@given(st.binary(max_size=200), st.booleans())
def test_any_bytes_are_messages_or_broken(data: bytes, masked: bool) -> None:
    reader = MessageReader(masked=masked)
    code = 1002
    try:
        for message in reader.feed(data):
            assert len(message.data) <= len(data)
    except Broken as broken:
        code = broken.code
    assert code in (1002, 1009)


def test_openings() -> None:
    opening = parse_opening(request_opening("robot:1", "/programs", "key").removesuffix(b"\r\n\r\n"))
    assert opening.line == "GET /programs HTTP/1.1"
    assert (opening.upgrades(), opening.key) == (True, "key")
    assert not parse_opening(b"GET / HTTP/1.1\r\nHost: x").upgrades()
    with pytest.raises(Broken):
        parse_opening(b"GET / HTTP/1.1\r\n no name: x")
