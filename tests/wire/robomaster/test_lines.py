"""Cutting the byte stream."""

import sys

from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.robomaster.lines import LINE_MAX, LineSplitter


def split(*chunks: bytes) -> list[str | None]:
    splitter = LineSplitter()
    return [text for chunk in chunks for text in splitter.feed(chunk)]


def test_several_commands_in_a_packet() -> None:
    assert split(b"a;b c;d;") == ["a", "b c", "d"]


def test_a_command_in_several_packets() -> None:
    assert split(b"chas", b"sis spe", b"ed ?;ro", b"bot") == ["chassis speed ?"]


def test_line_ends_and_empty_commands_are_left_out() -> None:
    assert split(b"command;\r\n;; \n version;\r\n") == ["command", "version"]


def test_floods_of_nothing_cost_little() -> None:
    """All robots wait while a packet is cut: 250,000 empty texts took 0.7 s."""
    splitter, calls = LineSplitter(), 0

    def count(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    sys.setprofile(count)
    found = list(splitter.feed(b"a;" + 1000 * b";" + 1000 * b" \r\n;" + b"b;"))
    sys.setprofile(None)
    assert found == ["a", "b"]
    assert calls < 100


def test_overlong_text_is_reported_once_and_next_read() -> None:
    assert split(b"x" * LINE_MAX + b";", b"ok;") == ["x" * LINE_MAX, "ok"]
    assert split(b"x" * (LINE_MAX + 1) + b";", b"ok;") == [None, "ok"]
    assert split(*[b"x" * 700] * 3, b"x;ok;") == [None, "ok"]


def test_a_megabyte_without_end_is_not_kept() -> None:
    splitter = LineSplitter()
    for _ in range(1024):
        assert list(splitter.feed(b"x" * 1024)) == []
        assert splitter.pending <= LINE_MAX
        assert splitter.within
    assert list(splitter.feed(b";version;")) == [None, "version"]


def test_bytes_that_are_no_text_are_no_error() -> None:
    assert split(b"\xff\xfe;") == ["\ufffd\ufffd"]


@given(st.lists(st.binary(max_size=2000), max_size=8))
def test_any_cut_of_stream_gives_the_same_texts(chunks: list[bytes]) -> None:
    assert split(*chunks) == split(b"".join(chunks))
