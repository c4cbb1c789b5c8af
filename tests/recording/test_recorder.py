"""Recording a simulated robot with its doors, in lockstep."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import json
import logging
from pathlib import Path

import httpx
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from mcap.reader import make_reader

from roboglot.cli.control import running
from roboglot.cli.recordings.record import _show
from roboglot.config import Config, ConsoleConfig, RecordConfig, RobotConfig, load_config
from roboglot.control.record_server import NAME, Answer, Request
from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.tap import Direction
from roboglot.recording.files import PartWriter
from roboglot.recording.reader import pair, read_messages, read_recording
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.narrowing import known

ADDRESS = free_addresses(1)


def config(data: Path, record: RecordConfig) -> Config:
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    return dataclasses.replace(
        base, robots=(RobotConfig("a", "universal", ADDRESS),), record=record, console=ConsoleConfig(enabled=False)
    )


async def ask(desk: Path, request: Request) -> Answer:
    return await running.exchange(desk, request, Answer, 30.0)


def size(path: str) -> int:
    return Path(path).stat().st_size


async def advance(started: Runtime, seconds: float) -> None:
    assert isinstance(started.clock, LockstepClock)
    await started.clock.advance(seconds)


async def test_failed_start_leaves_no_recording(tmp_path: Path) -> None:
    async with await asyncio.start_server(lambda *_: None, ADDRESS, 1448):
        started = Runtime(config(tmp_path / "data", RecordConfig(to=str(tmp_path / "r.mcap"))))
        with pytest.raises(OSError, match="in use"):
            await started.start()
        await started.close()
    assert not (tmp_path / "r.mcap").exists()


async def test_mcap_reads_everything_that_was_recorded(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    started = Runtime(config(tmp_path / "data", RecordConfig(to=str(path))))
    await started.start()
    async with httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", verify=False) as client:
        assert (await client.get("/api/core/system/v1/power/status")).status_code == 200
        wrong = await client.post("/api/core/motion/v1/actions", json={"action_name": "fly", "password": "geheim"})
        assert wrong.status_code == 400
    await advance(started, 6.0)
    logging.getLogger("roboglot.somewhere").warning("a line of the log")
    started.recorder.mark("now it happens")
    await started.close()
    recording = read_recording(path)
    assert recording.whole
    assert recording.facts["world"] == "empty"
    assert {"config.json", "universal.toml", "empty.toml"} <= recording.attachments.keys()
    topics = recording.topics
    assert topics["/a/scan"] >= 50
    assert topics["/a/pose"] == topics["/truth/a/pose"] >= 61  # closing takes a while, too
    assert {"/tf", "/a/map", "/a/battery", "/a/events", "/a/slamware", "/marks", "/log"} <= topics.keys()
    asked, _ = pair(recording.exchanges)
    assert [(a.request.operation, a.replies[0].status) for a in asked] == [
        ("GET /api/core/system/v1/power/status", "200"),
        ("POST /api/core/motion/v1/actions", "400"),
    ]
    assert b"geheim" not in path.read_bytes() + b"".join(e.payload for e in recording.exchanges)
    assert [message.json() for message in read_messages(path, "/marks")] == [{"text": "now it happens"}]
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        scans = [LaserScan.FromString(message.data) for _, _, message in reader.iter_messages(topics=["/a/scan"])]
    assert len(scans) == topics["/a/scan"]
    assert scans[0].frame_id == "a/laser"
    assert len(scans[0].ranges) > 100


async def test_recording_is_started_marked_and_ended_from_outside(tmp_path: Path) -> None:
    started = Runtime(config(tmp_path / "data", RecordConfig()))
    await started.start()
    desk = tmp_path / "data" / NAME
    assert not (await ask(desk, Request())).on
    assert "no recording is under way" in (await ask(desk, Request("mark", "x"))).error
    assert "no recording is under way" in (await ask(desk, Request("stop"))).error
    refused = await ask(desk, Request("start", "/proc/nowhere/x.mcap"))
    assert "cannot be written" in refused.error
    assert "null" in (await ask(desk, Request("start", f"{tmp_path}/\0"))).error
    assert (await ask(desk, Request("start", f"{tmp_path}/"))).on
    assert "under way" in (await ask(desk, Request("start", f"{tmp_path}/"))).error
    await advance(started, 1.0)
    assert not (await ask(desk, Request("mark", "x"))).error
    ended = await ask(desk, Request("stop"))
    assert not ended.on
    assert ended.entries > 20
    assert not started.fleet.robots["a"].tap.watched
    before = size(ended.path)
    await advance(started, 1.0)
    assert size(ended.path) == before
    again = await ask(desk, Request("start", f"{tmp_path}/"))
    assert again.path != ended.path
    await advance(started, 0.5)
    await started.close()
    assert read_recording(Path(again.path)).topics["/a/pose"] >= 5


async def test_last_minutes_are_written_when_a_fault_comes(tmp_path: Path) -> None:
    started = Runtime(config(tmp_path / "data", RecordConfig(ring=True, ring_seconds=3.0)))
    await started.start()
    await advance(started, 8.0)
    robot = started.fleet.robots["a"]
    robot[Health].set("motor alarm", True, "motor", FaultLevel.ERROR, "it does not turn")
    await advance(started, 3.0)
    (path,) = (tmp_path / "data" / "recordings").iterdir()
    await started.close()
    recording = read_recording(path)
    assert 2.0 <= recording.seconds <= 5.0
    events = [message.json()["event"] for message in read_messages(path, "/a/events")]
    assert "FaultRaised" in events
    assert {"/a/body", "/a/map", "/a/control", "/truth/state"} <= set(recording.topics)  # from before the last minutes


async def test_a_second_recording_knows_how_things_stand(tmp_path: Path) -> None:
    started = Runtime(config(tmp_path / "data", RecordConfig(ring=True)))
    await started.start()
    await advance(started, 8.0)
    started.recorder.start(str(tmp_path / "late.mcap"))
    await advance(started, 6.0)
    await started.close()
    topics = set(read_recording(tmp_path / "late.mcap").topics)
    assert {"/a/body", "/a/battery", "/a/map", "/a/faults", "/a/control", "/truth/state"} <= topics


async def test_last_minutes_are_written_after_an_uncaught_error(tmp_path: Path) -> None:
    loop = asyncio.get_running_loop()
    heard: list[object] = []
    loop.set_exception_handler(lambda _loop, context: heard.append(context.get("exception")))
    started = Runtime(config(tmp_path / "data", RecordConfig(ring=True, ring_seconds=3.0)))
    await started.start()
    await advance(started, 2.0)
    before = loop.get_exception_handler()

    def break_down() -> None:
        raise ZeroDivisionError("the motor's driver divides by nothing")

    loop.call_soon(break_down)
    await asyncio.sleep(0)
    await advance(started, 0.5)
    (path,) = (tmp_path / "data" / "recordings").iterdir()
    await started.close()
    assert "crash-ZeroDivisionError" in path.name
    assert read_recording(path).topics["/a/pose"] >= 15
    assert [type(error) for error in heard] == [ZeroDivisionError]  # it is handled as usual
    assert loop.get_exception_handler() is not before


async def test_endless_stream_of_pushes_is_recorded_in_order(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    started = Runtime(config(tmp_path / "data", RecordConfig(to=str(path))))
    await started.start()
    reader, writer = await asyncio.open_connection(ADDRESS, 40923)
    writer.write(b"command;")
    await reader.readuntil(b";")
    writer.write(b"chassis push position on pfreq 10;")
    await reader.readuntil(b";")
    await advance(started, 2.0)
    writer.close()
    with contextlib.suppress(OSError):
        await writer.wait_closed()
    await started.close()
    exchanges = read_recording(path).of("a", "robomaster")
    pushes = [e for e in exchanges if e.direction is Direction.PUSH and e.operation == "> chassis push"]
    assert 19 <= len(pushes) <= 21
    assert [e.stamp for e in pushes] == sorted(e.stamp for e in pushes)
    assert json.loads(json.dumps(pushes[0].status)) == ""


async def test_full_disk_is_the_only_reason_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    started = Runtime(config(tmp_path / "data", RecordConfig(to=str(tmp_path / "r.mcap"))))
    await started.start()
    await advance(started, 2.0)
    recorder = started.recorder

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(PartWriter, "flush", full)
    monkeypatch.setattr("mcap.writer.Writer.finish", full)
    for _ in range(3):  # long enough for two warnings, if there were some
        await asyncio.to_thread(known(recorder._thread).settle)
        await advance(started, 12.0)
    ended = await recorder.stop()
    await started.close()
    assert ended.failure == "No space left on device"
    assert ended.dropped
    assert ended.bytes > 0
    said = [record.getMessage() for record in caplog.records if "lost" in record.getMessage()]
    assert said == []


def test_status_says_that_nothing_more_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="ended: no room; 9 values since then are lost"):
        _show(Answer(on=True, path="x.mcap", entries=5, bytes=100, dropped=9, failure="no room"))
    said = capsys.readouterr()
    assert said.out.startswith("recorded to x.mcap: 5 values, 100 bytes; nothing more is written")
    assert not said.err
