"""A recording that is cut off anywhere is named with what was read, and with what was not."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import pytest
from mcap.writer import Writer

from roboglot.recording.reader import records

SECOND = 10**9


def written(path: Path) -> bytes:
    """Return a recording of three messages, each in its own chunk, without an end."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/t", "json", writer.register_schema("s", "jsonschema", b"{}"))
        for at in (1, 2, 4):
            writer.add_message(channel, at * SECOND, b"{}", at * SECOND)
            writer.flush()
    return path.read_bytes()


def test_a_cut_is_named_with_its_loss(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    whole, cut, texts = written(tmp_path / "r.mcap"), tmp_path / "cut.mcap", set[str]()
    for length in range(17, len(whole) + 1):
        cut.write_bytes(whole[:length])
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            count = sum(channel is not None for _, channel, _ in records(cut))
        (line,) = caplog.messages
        texts.add(re.sub(r"\d+ bytes", "N bytes", line.removeprefix(f"{cut} is cut off: ")))
        assert ("no messages" in line) is (count == 0)
    ends = ((0.0, 1), (1.0, 2), (3.0, 4))
    found = ["it has no messages", *(f"it is read until {s} s (1970-01-01 00:00:0{end} UTC)" for s, end in ends)]
    rests = "", "; the last byte is not a whole record", "; the last N bytes are not a whole record"
    assert texts == {read + rest for read in found for rest in rests}
