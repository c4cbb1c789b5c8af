"""Messages are found by time in any chunk, with overlapping chunks and truncated files, too."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from typer.testing import CliRunner

from roboglot.cli.recordings.record import app
from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Attachment, Files, Limits, Origin
from roboglot.recording.message_index import MessageIndex, TimedMessage, read_outline
from roboglot.recording.reader import BadRecording, Recording, read_recording, summary_of
from roboglot.recording.redaction import Redaction

MESSAGES = st.lists(st.tuples(st.integers(0, 2), st.integers(1, 60)), min_size=1, max_size=40)
FLUSHED = st.sets(st.integers(0, 40))  # messages before which a chunk ends


def write(path: Path, messages: Sequence[tuple[int, int]], flushed: set[int], *, whole: bool = True) -> None:
    """Write messages of three topics, each with its number as data."""
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("s", "jsonschema", b"{}")
        channels = [writer.register_channel(f"/t{number}", "json", schema) for number in range(3)]
        for number, (topic, at) in enumerate(messages):
            if number in flushed:
                writer.flush()
            writer.add_message(channels[topic], at, struct.pack("<I", number), at)
        writer.flush()
        if whole:
            writer.finish()


@settings(max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(MESSAGES, FLUSHED, st.integers(0, 61), st.booleans())
def test_all_come_from_any_moment_in_their_order(
    tmp_path: Path, messages: list[tuple[int, int]], flushed: set[int], since: int, whole: bool
) -> None:
    path = tmp_path / "r.mcap"
    write(path, messages, flushed, whole=whole)
    index = MessageIndex(path)
    names = [int(topic.name[2:]) for topic in index.topics]
    batches = list(index.play(since))
    played = [message for batch in batches for message in batch]
    assert [message.at for message in played] == sorted(at for _, at in messages if at >= since)
    found = {(names[message.topic], message.at, message.data) for message in played}
    numbered = enumerate(messages)
    assert found == {(topic, at, struct.pack("<I", number)) for number, (topic, at) in numbered if at >= since}
    for before, after in pairwise(batches):  # messages of one instant stay together
        assert before[-1].at < after[0].at


@settings(max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(MESSAGES, FLUSHED, st.integers(0, 61), st.sets(st.integers(0, 2)), st.booleans())
def test_the_last_of_each_topic_is_found(
    tmp_path: Path, messages: list[tuple[int, int]], flushed: set[int], at: int, wanted: set[int], whole: bool
) -> None:
    path = tmp_path / "r.mcap"
    write(path, messages, flushed, whole=whole)
    index = MessageIndex(path)
    places = {int(topic.name[2:]): place for place, topic in enumerate(index.topics)}
    found = index.last(at, {places[topic] for topic in wanted if topic in places})
    due = {topic: [when for one, when in messages if one == topic and when <= at] for topic in wanted}
    assert {(message.topic, message.at) for message in found} == {
        (places[topic], max(at)) for topic, at in due.items() if at
    }
    assert all(isinstance(message, TimedMessage) for message in found)


def test_parts_are_one_recording(tmp_path: Path) -> None:
    write(tmp_path / "r.mcap", [(0, 1), (1, 2)], set())
    write(tmp_path / "r-002.mcap", [(1, 3), (2, 4)], set(), whole=False)
    index = MessageIndex(tmp_path / "r.mcap")
    assert [message.at for batch in index.play(2) for message in batch] == [2, 3, 4]
    assert [topic.name for topic in index.topics] == ["/t0", "/t1", "/t2"]


def test_damaged_chunk_is_no_end_of_program(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    write(path, [(0, at) for at in range(1, 40)], {20})
    index = MessageIndex(path)
    data = bytearray(path.read_bytes())
    data[110:120] = bytes(10)
    path.write_bytes(data)
    with pytest.raises(BadRecording, match="damaged"):
        list(index.play(0))
    (tmp_path / "no.mcap").write_bytes(b"no recording")
    with pytest.raises(BadRecording):
        MessageIndex(tmp_path / "no.mcap")


TICKS = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 3)), min_size=1, max_size=20)  # topic, s since the last


def record(folder: Path, ticks: Sequence[tuple[int, int]], part_seconds: float) -> list[Path]:
    """Write a recording in parts; the battery's level is repeated in each."""
    origin = Origin({"version": "1", "world": "w"}, [Attachment("world.toml", "text/plain", b"x = 1")])
    files = Files(folder / "r.mcap", origin, Redaction(), Limits(part_seconds=part_seconds))
    files.open(NANO)
    at = NANO
    for topic, seconds in ticks:
        at += seconds * NANO
        name = ("/a/events", "/b/events", "/a/body")[topic]
        kind = "state" if topic == 2 else "event"
        files.write(Entry(name, kind, at, at, {"event": "Tick"}))
        files.flush()
    files.close()
    return sorted(folder.glob("*.mcap"))


def outline_of(recording: Recording) -> tuple[object, ...]:
    files = {name: bytes(data) for name, data in recording.attachments.items()}
    return recording.facts, files, recording.topics, recording.first, recording.last, recording.whole


@settings(max_examples=60, deadline=None)
@given(TICKS, st.sampled_from([1.0, 4.0, 100.0]), st.integers(0, 400), st.integers(0, 5))
def test_outline_says_what_all_messages_say(
    ticks: Sequence[tuple[int, int]], part_seconds: float, cut: int, which: int
) -> None:
    with TemporaryDirectory() as folder:
        paths = record(Path(folder), ticks, part_seconds)
        shortened = paths[which % len(paths)]
        shortened.write_bytes(shortened.read_bytes()[: -cut or None])
        for path in paths:
            assert outline_of(read_outline(path)) == outline_of(read_recording(path))


def test_outline_leaves_chunks_unread(tmp_path: Path) -> None:
    (path,) = record(tmp_path, [(0, 1), (1, 1), (0, 1)], 100.0)
    expected = outline_of(read_recording(path))
    summary = summary_of(io.BytesIO(path.read_bytes()))
    assert summary
    row = summary.chunk_indexes[1]
    whole = path.read_bytes()
    end = row.chunk_start_offset + row.chunk_length
    path.write_bytes(whole[: end - 8] + bytes(8) + whole[end:])
    assert outline_of(read_outline(path)) == expected
    assert read_recording(path).topics == {"/a/events": 2}
    for options, counts in ([], {"2 /a/events", "1 /b/events"}), (["--check"], {"2 /a/events"}):
        said = CliRunner().invoke(app, ["info", *options, str(path)]).stdout
        assert {line.strip() for line in said.splitlines() if "/events" in line} == counts
        assert ("incomplete" in said) is bool(options)
    path.write_bytes(whole[: row.chunk_start_offset] + bytes(40) + whole[row.chunk_start_offset + 40 :])
    assert outline_of(read_outline(path)) == outline_of(read_recording(path))  # the index does not fit the file
