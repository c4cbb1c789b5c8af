"""Files of a recording: open with mcap's own reader, survive kill -9, end at their limits, never stop the robot."""

from __future__ import annotations

import errno
import io
import re
import struct
import subprocess
import sys
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Attachment, Channel, Files, Limits, OpenChunk, Origin, PartWriter
from roboglot.recording.reader import parts, read_messages, records
from roboglot.recording.redaction import Redaction
from roboglot.recording.repair import mend
from roboglot.recording.ring import Ring
from roboglot.recording.thread import WriterThread
from tests.recording.files.doctor import Doctor

CHILD = [sys.executable, "-m", "tests.recording.writing_child"]  # warm, so it ends with this process
ROOT = Path(__file__).parents[3]
KILLS = 10
ORIGIN = Origin({"version": "1"}, [Attachment("world.toml", "text/plain", b"x = 1")])


def tick(number: int, seconds: float = 0.0) -> Entry:
    at = round(seconds * NANO)
    return Entry("/a/events", "event", at, at, {"event": "Tick", "number": number})


def numbers(path: Path) -> list[int]:
    return [message.json()["number"] for message in read_messages(path, "/a/events")]


def test_file_opens_with_the_reader_of_mcap_itself(tmp_path: Path) -> None:
    part = PartWriter(tmp_path / "x.mcap", ORIGIN, Redaction(), 0)
    for number in range(5):
        part.write(tick(number, number))
        part.flush()
    part.close()
    with (tmp_path / "x.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 5
        assert [message.sequence for _, _, message in reader.iter_messages()] == [1, 2, 3, 4, 5]
        assert [a.data for a in reader.iter_attachments()] == [b"x = 1"]
        (head,) = reader.iter_metadata()
        assert head.name == "roboglot"
        assert head.metadata == {"version": "1", "part": "1", "begun": head.metadata["begun"]}
        assert datetime.fromisoformat(head.metadata["begun"]).tzinfo == UTC


@pytest.mark.timeout(900)  # a hang
@pytest.mark.parametrize(("rounds", "kills"), [(1, 2), pytest.param(10, KILLS, marks=pytest.mark.slow)])
def test_written_messages_survive_kill_9(tmp_path: Path, rounds: int, kills: int) -> None:
    for number in range(rounds):
        (tmp_path / str(number)).mkdir()
        kill_writers(tmp_path / str(number), kills)


def kill_writers(tmp_path: Path, kills: int) -> None:
    """Kill programs that write, and look at what they have written."""
    children = [
        subprocess.Popen([*CHILD, tmp_path / f"{n}.mcap"], stdout=subprocess.PIPE, cwd=ROOT) for n in range(kills)
    ]
    killed = dict[int, int]()
    for child in children:
        assert child.stdout
        child.stdout.readline()
    deadline = time.monotonic() + 60.0
    while not all(numbers(tmp_path / f"{number}.mcap") for number in range(kills)):
        assert time.monotonic() < deadline
        time.sleep(0.2)
    time.sleep(1.0)  # a few more flushes
    for number, child in enumerate(children):
        killed[number] = time.time_ns()
        child.kill()
        child.wait()
        assert child.stdout
        child.stdout.close()
    for number, moment in killed.items():
        path = tmp_path / f"{number}.mcap"
        found = numbers(path)
        assert found == list(range(1, len(found) + 1))
        last = max(message.at for message in read_messages(path))
        assert moment - last < 10 * NANO  # a second on a quiet machine: benchmarks/doors/recording.py
        assert mend(path, tmp_path / f"{number}-whole.mcap") == len(found)
        with (tmp_path / f"{number}-whole.mcap").open("rb") as file:
            assert len(list(make_reader(file).iter_messages())) == len(found)


def test_cut_file_is_read_until_the_cut(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    part = PartWriter(path, ORIGIN, Redaction(), 0)
    for number in range(20):
        part.write(tick(number))
        part.flush()
    part.close()
    whole, cut = path.read_bytes(), tmp_path / "cut.mcap"
    longest = 0
    for end in range(200, len(whole), 97):
        cut.write_bytes(whole[:end])
        found = numbers(cut)
        assert found == list(range(len(found)))
        assert len(found) >= longest
        longest = len(found)
    assert longest == 20


@pytest.mark.parametrize(
    ("lost", "said"),
    [
        (0, ""),
        (40, ""),  # of the index: all messages are there
        (0.5, r"cut.mcap is cut off: it is read until \d+\.0 s \(1970-01-01 00:00:\d\d UTC\)(; the last [1-9]|$)"),
    ],
)
def test_cut_file_is_named_with_its_end(
    lost: float, said: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    part = PartWriter(tmp_path / "x.mcap", ORIGIN, Redaction(), 0)
    for number in range(20):
        part.write(tick(number, number))
        part.flush()
    part.close()
    whole = (tmp_path / "x.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) - round(lost if lost >= 1 else lost * len(whole))])
    read = numbers(tmp_path / "cut.mcap")
    assert len(caplog.messages) == bool(said)
    if said:
        assert re.search(said, caplog.text)
        assert f"until {read[-1]}.0 s" in caplog.text


def test_recording_continues_in_parts_and_keeps_its_total(tmp_path: Path) -> None:
    files = Files(tmp_path / "x.mcap", ORIGIN, Redaction(), Limits(part_seconds=10.0, total_bytes=6000))
    files.open(0)
    for second in range(100):
        files.write(tick(second, second))
    files.close()
    there = sorted(tmp_path.iterdir())
    assert files.deleted == 10 - len(there) > 0
    assert sum(path.stat().st_size for path in there) < 6000 + 3000
    assert numbers(there[-1])[-1] == 99
    assert parts(there[-1]) == [there[-1]]


def test_a_part_ends_at_its_size_too(tmp_path: Path) -> None:
    files = Files(tmp_path / "x.mcap", ORIGIN, Redaction(), Limits(part_bytes=2000))
    files.open(0)
    for number in range(100):
        files.write(tick(number))
        files.flush()  # unflushed bytes do not count yet
    files.close()
    found = parts(tmp_path / "x.mcap")
    assert len(found) > 3
    assert all(path.stat().st_size < 2000 + 3000 for path in found)  # its summary is added
    assert numbers(tmp_path / "x.mcap") == list(range(100))


def test_all_parts_are_read_as_one(tmp_path: Path) -> None:
    files = Files(tmp_path / "x.mcap", ORIGIN, Redaction(), Limits(part_seconds=10.0))
    files.open(0)
    for second in range(35):
        files.write(tick(second, second))
    files.close()
    assert [path.name for path in parts(tmp_path / "x.mcap")] == [
        "x.mcap",
        "x-002.mcap",
        "x-003.mcap",
        "x-004.mcap",
    ]
    assert numbers(tmp_path / "x.mcap") == list(range(35))


def test_each_part_begins_with_how_things_stand(tmp_path: Path) -> None:
    files = Files(tmp_path / "x.mcap", ORIGIN, Redaction(), Limits(part_seconds=10.0, total_bytes=9000))
    files.open(0)
    for number, topic in enumerate(("/a/control", "/a/faults", "/a/control")):  # noted once, at the start
        files.write(Entry(topic, "state", number, number, {"number": number}))
    for second in range(100):
        files.write(tick(second, second))
    files.close()
    assert not (tmp_path / "x.mcap").exists()
    first, *later = sorted(tmp_path.iterdir())
    assert later
    assert parts(first) == [first, *later]
    standing = list(read_messages(first, "/a/control", "/a/faults"))  # once, although each part has it
    assert sorted((one.topic, one.json()["number"]) for one in standing) == [("/a/control", 2), ("/a/faults", 1)]
    assert {one.at for one in standing} == {next(read_messages(first, "/a/events")).at}
    assert numbers(first) == list(range(numbers(first)[0], 100))
    assert len(list(read_messages(later[-1], "/a/control"))) == 1


def test_files_of_others_are_no_parts(tmp_path: Path) -> None:
    """A name that ends in a number makes no part."""
    for name in ("run-001.mcap", "run-002.mcap"):
        files = Files(tmp_path / name, ORIGIN, Redaction(), Limits())
        files.open(0)
        files.write(tick(1))
        files.close()
    assert parts(tmp_path / "run-001.mcap") == [tmp_path / "run-001.mcap"]


class SlowSink:
    def __init__(self) -> None:
        self.go_on, self.written, self.closed = threading.Event(), list[Entry](), False

    def write(self, entry: Entry) -> None:
        self.go_on.wait(30)
        self.written.append(entry)

    def flush(self) -> None:
        pass

    def close(self) -> None:
        self.closed = True


def test_overflow_is_counted_and_the_rest_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.recording.thread.ENTRIES_MAX", 10)
    sink = SlowSink()
    thread = WriterThread(sink)
    put = [thread.put(tick(number)) for number in range(100)]
    assert thread.dropped == put.count(False) > 0
    sink.go_on.set()
    thread.close()
    assert len(sink.written) == put.count(True)
    assert sink.closed


class FullDisk(SlowSink):
    def write(self, entry: Entry) -> None:  # noqa: ARG002
        raise OSError(errno.ENOSPC, "No space left on device")

    def close(self) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")


def test_full_disk_ends_recording_and_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    thread = WriterThread(FullDisk())
    thread.put(tick(1))
    thread.settle()
    assert thread.failure == "No space left on device"
    assert not thread.put(tick(2))
    thread.close()
    assert [record.message for record in caplog.records] == ["recording ends: No space left on device"]


def test_only_the_unwritable_value_is_left_out(tmp_path: Path) -> None:
    files = Files(tmp_path / "x.mcap", ORIGIN, Redaction(), Limits())
    files.open(0)
    thread = WriterThread(files)
    thread.put(tick(1))
    thread.put(Entry("/a/map", "grid", 0, 0, "no map"))
    thread.put(tick(-1, -1.0))  # a time that the format does not have
    thread.put(tick(2))
    thread.close()
    assert numbers(tmp_path / "x.mcap") == [1, 2]
    assert thread.dropped == 2


def test_a_line_logged_within_a_put_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    sink = SlowSink()
    sink.go_on.set()
    thread, full, logged = WriterThread(sink), WriterThread._full, list[bool]()

    def collect(self: WriterThread, weight: int) -> bool:  # as the garbage collector may, in any call
        if not logged:
            logged.append(True)
            logged.append(thread.put(tick(1)))
        return full(self, weight)

    monkeypatch.setattr(WriterThread, "_full", collect)
    putting = threading.Thread(target=thread.put, args=(tick(2),), daemon=True)
    putting.start()
    putting.join(60)
    assert logged == [True, True]
    thread.close()
    assert sink.written == [tick(1), tick(2)]


def test_ring_writes_the_last_minutes_and_no_more(tmp_path: Path) -> None:
    ring = Ring(ORIGIN, Redaction(), seconds=60.0)
    for number in range(3000):
        ring.write(tick(number, number / 10))
    count = ring.save(tmp_path / "last.mcap")
    found = numbers(tmp_path / "last.mcap")
    assert len(found) == count
    assert found[-1] == 2999
    assert 2999 - 620 <= found[0] <= 2999 - 580
    kinds = [type(record).__name__ for record, _, _ in records(tmp_path / "last.mcap")]
    assert kinds[-1] == "Footer"


def test_a_file_keeps_the_rules_of_mcap_doctor(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    part = PartWriter(path, ORIGIN, Redaction(), 0)
    for number in range(40):
        part.write(tick(number, number / 7))
        part.write(Entry("/marks", "mark", number, number, {"text": "x" * number}))
        if number % 6 == 0:
            part.flush()
    part.close()
    data = path.read_bytes()
    assert Doctor(data).examine() == []
    for place in (len(data) // 2, len(data) - 30):  # and it finds the fault
        broken = bytearray(data)
        broken[place] ^= 0xFF
        assert not is_well(bytes(broken))


def is_well(data: bytes) -> bool:
    try:
        return Doctor(data).examine() == []
    except (struct.error, AssertionError, zstandard.ZstdError, KeyError, ValueError):
        return False


def test_a_mended_file_keeps_them_too(tmp_path: Path) -> None:
    part = PartWriter(tmp_path / "x.mcap", ORIGIN, Redaction(), 0)
    for number in range(20):
        part.write(tick(number, number))
        part.flush()
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "x.mcap").read_bytes()[:-11])
    part.close()
    mend(tmp_path / "cut.mcap", tmp_path / "whole.mcap")
    assert Doctor((tmp_path / "whole.mcap").read_bytes()).examine() == []
    assert (tmp_path / "whole.mcap").stat().st_mode == (tmp_path / "x.mcap").stat().st_mode  # for its owner only


@given(
    st.lists(
        st.just("flush") | st.tuples(st.integers(0, 3), st.integers(0, 2**40), st.binary(max_size=90)), max_size=30
    )
)
def test_chunks_are_the_librarys(messages: list[str | tuple[int, int, bytes]]) -> None:
    files: list[bytes] = []
    for ours in (False, True):
        stream = io.BytesIO()
        writer: Any = Writer(stream)
        writer.start()
        chunk = OpenChunk(writer, stream, level=3)  # the library's
        schema = writer.register_schema("x", "jsonschema", b"{}")

        numbered = [writer.register_channel(f"/{number}", "json", schema) for number in range(3)]
        channels = [Channel(number, lambda _at, value: value) for number in numbered]
        for message in messages:
            if isinstance(message, str) or message[0] == len(channels):
                chunk.write()
                writer.flush()
            if isinstance(message, str):
                continue
            number, at, data = message
            if number == len(channels):
                late = writer.register_channel("/late", "json", schema)
                channels.append(Channel(late, lambda _at, value: value))
            if ours:
                chunk.add(channels[number], at, data, at + 5, number)
            else:
                writer.add_message(channels[number].number, at, data, at + 5, number)
        chunk.write()
        writer.finish()
        files.append(stream.getvalue())
    assert files[0] == files[1]
