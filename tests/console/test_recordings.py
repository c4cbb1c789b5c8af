"""The recordings in the data folder on pages: listed, fetched, compared, deleted; nothing outside of the folder."""

from __future__ import annotations

import asyncio
import os
from io import BytesIO
from pathlib import Path

import msgspec
import pytest
from mcap.writer import Writer

from roboglot.console.http import Problem
from roboglot.console.recordings import kept
from roboglot.console.recordings.kept import RecordingFolder
from roboglot.model.errors import Busy, NotFound, Refused
from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Files, Limits, Origin, PartWriter
from roboglot.recording.redaction import Redaction
from tests.console.conftest import ServedConsole
from tests.narrowing import known

FACTS = {"version": "1", "world": "office", "robots": '{"a": "universal", "b": "cyberdog2"}'}


def written(path: Path, seconds: int, limits: Limits | None = None, facts: dict[str, str] | None = None) -> None:
    files = Files(path, Origin(FACTS | (facts or {})), Redaction(), limits or Limits())
    files.open(1000 * NANO)
    for second in range(seconds + 1):
        files.write(Entry("/a/events", "event", (1000 + second) * NANO, 0, {"event": "Tick", "number": second}))
        files.flush()
    files.close()


def test_recordings_are_listed_with_what_people_look_for(tmp_path: Path) -> None:
    for number, name in enumerate(("old", "new")):
        written(tmp_path / f"{name}.mcap", 5 + number)
    (tmp_path / "notes.txt").write_text("no recording")
    new, old = RecordingFolder(tmp_path).look(None)
    assert (new.file, new.seconds, new.robots, new.world) == ("new.mcap", 6.0, ["a", "b"], "office")
    assert (old.file, old.seconds, old.bytes) == ("old.mcap", 5.0, (tmp_path / "old.mcap").stat().st_size)
    assert f"--robot 'a=recording:{tmp_path / 'new.mcap'}#a'" in new.play


def test_copies_keep_the_date_of_the_recording(tmp_path: Path) -> None:
    written(tmp_path / "copied.mcap", 1)
    written(tmp_path / "later.mcap", 1)
    os.utime(tmp_path / "copied.mcap", (2e9, 2e9))
    begun = {one.file: one.at for one in RecordingFolder(tmp_path).look(None)}
    assert begun["later.mcap"] - 60 < begun["copied.mcap"] <= begun["later.mcap"] < 2e9


@pytest.mark.parametrize(
    "facts",
    [
        {"robots": "no JSON"},
        {"robots": "7"},
        {"robots": '["a"]'},
        {"robots": '{"a": 1}'},
        {"robots": "[" * 100_000},
        {"begun": "yesterday", "robots": "{"},
    ],
)
def test_damaged_head_harms_no_other_recording(tmp_path: Path, facts: dict[str, str]) -> None:
    written(tmp_path / "good.mcap", 2)
    written(tmp_path / "bad.mcap", 3, facts=facts)
    bad, good = sorted(RecordingFolder(tmp_path).look(None), key=lambda one: one.file)
    assert (good.damage, good.robots, good.seconds) == ("", ["a", "b"], 2.0)
    assert (bad.damage, bad.robots) == ("the list of robots at its head cannot be read", [])
    msgspec.json.encode([bad, good])
    assert RecordingFolder(tmp_path).path("bad.mcap").exists()
    RecordingFolder(tmp_path).remove("bad.mcap", None)
    assert [path.name for path in tmp_path.iterdir()] == ["good.mcap"]


@pytest.mark.parametrize("number", ["two", "", "9" * 5000, "-1"])
def test_damaged_number_of_a_part_is_named(tmp_path: Path, number: str) -> None:
    (tmp_path / "a.mcap").write_bytes(head_of_part(number))
    (one,) = RecordingFolder(tmp_path).look(None)
    assert (one.damage, one.file) == ("the number of the part at its head cannot be read", "a.mcap")


def test_names_of_other_alphabets_are_listed(tmp_path: Path) -> None:
    written(tmp_path / "good.mcap", 2)
    (tmp_path / os.fsdecode(b"\xff\xfe.mcap")).write_bytes((tmp_path / "good.mcap").read_bytes())
    found = {one.damage for one in RecordingFolder(tmp_path).look(None)}
    assert found == {"", "its name is not UTF-8: rename the file"}
    msgspec.json.encode(RecordingFolder(tmp_path).look(None))


def test_parts_are_one_recording(tmp_path: Path) -> None:
    written(tmp_path / "long.mcap", 20, Limits(part_seconds=5.0))
    written(tmp_path / "walk-002.mcap", 3)  # a name that looks like that of a part
    long, walk = sorted(RecordingFolder(tmp_path).look(None), key=lambda one: one.file)
    assert [part.file for part in long.parts] == ["long.mcap", *(f"long-00{n}.mcap" for n in (2, 3, 4))]
    assert (long.seconds, len(walk.parts), walk.seconds) == (20.0, 1, 3.0)
    RecordingFolder(tmp_path).remove("long.mcap", None)
    assert [path.name for path in tmp_path.iterdir()] == ["walk-002.mcap"]


def test_files_without_an_end_have_no_length(tmp_path: Path) -> None:
    written(tmp_path / "killed.mcap", 3)
    os.truncate(tmp_path / "killed.mcap", (tmp_path / "killed.mcap").stat().st_size - 100)
    (tmp_path / "other.mcap").write_bytes(b"no MCAP at all")
    (tmp_path / "empty.mcap").touch()
    found = {one.file: (one.seconds, one.damage) for one in RecordingFolder(tmp_path).look(None)}
    assert found == {
        "killed.mcap": (None, ""),
        "other.mcap": (None, "other.mcap is not an MCAP file"),
        "empty.mcap": (None, "empty.mcap is not an MCAP file"),
    }


def head_of_part(number: str) -> bytes:
    """Return a recording without an end whose head says that it is this part."""
    file = BytesIO()
    writer = Writer(file)
    writer.start(profile="", library="roboglot")
    writer.add_metadata("roboglot", FACTS | {"part": number})
    return file.getvalue()


@pytest.mark.parametrize("strange", [{"robots": "no JSON"}, {"robots": "[" * 100_000}, {"robots": "[1, {}]"}])
def test_strange_facts_hide_no_recording(tmp_path: Path, strange: dict[str, str]) -> None:
    written(tmp_path / "ours.mcap", 3)
    with (tmp_path / "theirs.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("roboglot", FACTS | {"part": "the first"} | strange)
        writer.finish()
    found = {one.file: (one.robots, one.parts[0].number) for one in RecordingFolder(tmp_path).look(None)}
    assert found == {"ours.mcap": (["a", "b"], 1), "theirs.mcap": ([], 1)}


def test_nothing_outside_of_the_folder_is_touched(tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir()
    written(tmp_path / "outside.mcap", 1)
    (folder / "link.mcap").symlink_to(tmp_path / "outside.mcap")
    (folder / ".hidden.mcap").touch()
    kept = RecordingFolder(folder)
    for name in (
        "../outside.mcap",
        "link.mcap",
        ".hidden.mcap",
        "..",
        "",
        "absent.mcap",
        str(tmp_path / "outside.mcap"),
    ):
        with pytest.raises(NotFound):
            kept.path(name)
        with pytest.raises(NotFound):
            kept.remove(name, None)
    assert (tmp_path / "outside.mcap").exists()


def test_running_recording_is_not_deleted(tmp_path: Path) -> None:
    written(tmp_path / "now.mcap", 1)
    kept = RecordingFolder(tmp_path)
    assert kept.look(tmp_path / "now.mcap")[0].running
    with pytest.raises(Refused, match="end the recording first"):
        kept.remove("now.mcap", tmp_path / "now.mcap")
    assert not kept.look(tmp_path.parent / "now.mcap")[0].running


async def test_one_comparison_at_a_time(tmp_path: Path) -> None:
    kept = RecordingFolder(tmp_path)
    async with kept._comparing:
        with pytest.raises(Busy):
            await kept.send_comparison("a.mcap", "b.mcap", "", lambda _message: pytest.fail("sent"))


async def test_recording_is_fetched_and_deleted(served: ServedConsole) -> None:
    assert await served.ask("/api/recordings") == (200, [])
    _, begun = await served.ask("/api/recording", {"do": "start"})
    await served.clock.advance(2.0)
    file = begun["file"]
    (listed,) = (await served.ask("/api/recordings"))[1]
    assert (listed["file"], listed["running"]) == (file, True)
    assert (await served.ask("/api/recording", {"do": "delete", "file": file}))[0] == 409
    await served.ask("/api/recording", {"do": "stop"})
    (listed,) = (await served.ask("/api/recordings"))[1]
    assert (listed["seconds"], listed["robots"]) == (2.0, ["a"])
    path = served.runtime.config.data / "recordings" / file
    assert await served.read(f"/api/recordings/{file}") == path.read_bytes()
    for unknown in ("no.mcap", "x" * 300 + ".mcap", "%00.mcap", "..%2Fno.mcap", "no.txt"):
        assert (await served.ask(f"/api/recordings/{unknown}"))[0] == 404
    assert (await served.ask("/api/recording", {"do": "delete", "file": file}))[0] == 200
    assert not path.exists()
    assert (await served.ask("/api/recording", {"do": "delete", "file": file}))[0] == 404


@pytest.mark.slow  # starts a process; tests/recording/test_drives.py compares
async def test_two_recordings_are_compared_on_a_page(served: ServedConsole) -> None:
    files = []
    for _ in range(2):
        files.append((await served.ask("/api/recording", {"do": "start"}))[1]["file"])
        await served.clock.advance(1.0)
        await served.ask("/api/recording", {"do": "stop"})
    one, other = files
    page = (await served.read(f"/api/recordings/{one}/compared/{other}/a")).decode()
    assert "ground truth: at most 0.00 m apart" in page
    assert await served.read(f"/api/recordings/{one}/compared/{other}/a") == page.encode()
    folder = served.runtime.config.data / "recordings"
    whole = (folder / other).read_bytes()
    summary = int.from_bytes(whole[-28:-20], "little")  # behind the record that ends the data, of 13 bytes
    (folder / "cut.mcap").write_bytes(whole[: summary - 13])
    assert "cut.mcap is cut off: " in (await served.read(f"/api/recordings/{one}/compared/cut.mcap/a")).decode()
    status, words = await served.ask(f"/api/recordings/{one}/compared/{other}/z")
    assert (status, words["error"]) == (409, f"{one} has nothing of that robot and protocol")


@pytest.mark.slow  # starts processes
async def test_comparison_without_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = Files(tmp_path / "large.mcap", Origin(FACTS), Redaction(), Limits())
    files.open(1000 * NANO)
    files.write(Entry("/a/events", "event", 1000 * NANO, 0, {"event": "Tick", "text": " " * (200 << 20)}))
    files.close()
    for limit in (20 << 20, 300 << 20):  # it cannot begin; it cannot go on
        monkeypatch.setattr(kept, "COMPARE_MEMORY", limit)
        with pytest.raises(Problem) as refused:
            await RecordingFolder(tmp_path).send_comparison(
                "large.mcap", "large.mcap", "", lambda _message: pytest.fail("sent")
            )
        assert refused.value.status == 409
    assert refused.value.why == "out of memory: the recordings are too large to be compared"


async def test_a_full_disk_ends_a_recording(served: ServedConsole, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every page showed REC on, and the next recording was refused until a person had ended that one."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    assert (await served.ask("/api/recording", {"do": "start"}))[1]["on"]
    with monkeypatch.context() as disk:
        disk.setattr(PartWriter, "flush", full)
        await served.clock.advance(2.0)
        await asyncio.to_thread(known(served.runtime.recorder._thread).settle)
        ended = (await served.ask("/api/recording"))[1]
        assert (ended["on"], ended["failure"]) == (False, "the recording ended early: the disk is full")
        assert (await served.ask("/api/recording", {"do": "mark", "text": "late"}))[0] == 409
    again = (await served.ask("/api/recording", {"do": "start"}))[1]
    assert (again["on"], again["failure"]) == (True, "")
    assert (await served.ask("/api/recording", {"do": "stop"}))[0] == 200
