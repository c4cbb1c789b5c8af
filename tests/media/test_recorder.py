"""MP4 recordings and JPEG stills."""

from __future__ import annotations

import asyncio
import io

import av
import pytest
from PIL import Image

from roboglot.media import recorder as module
from roboglot.media.recorder import Recorder
from roboglot.media.stills import jpeg
from roboglot.media.video import VideoStream
from roboglot.model.errors import Busy, Refused, RobotError
from tests.media.conftest import HEIGHT, WIDTH, number_of, picture


@pytest.fixture
def recorder(camera, lockstep):
    return Recorder(VideoStream(camera, lockstep), lockstep)


async def test_a_recording_opens_and_shows_what_was(recorder, lockstep, tmp_path):
    path = tmp_path / "tour.mp4"
    recorder.start(path)
    assert recorder.recording
    await lockstep.advance(1.21)
    assert not path.exists()
    done = await recorder.stop()
    assert done.path == path
    assert done.size == path.stat().st_size
    assert done.seconds == pytest.approx(35 / 30, abs=0.01)
    with av.open(str(path)) as file:
        frames = [(number_of(frame.to_ndarray()[:HEIGHT]), frame.time) for frame in file.decode(video=0)]
    assert [number for number, _ in frames] == list(range(36))
    assert frames[-1][1] == pytest.approx(35 / 30, abs=0.001)
    assert [entry.name for entry in tmp_path.iterdir()] == ["tour.mp4"]


async def test_one_at_time_and_stop_needs_a_start(recorder, lockstep, tmp_path):
    with pytest.raises(Refused):
        await recorder.stop()
    recorder.start(tmp_path / "a.mp4")
    with pytest.raises(Busy):
        recorder.start(tmp_path / "b.mp4")
    await lockstep.advance(0.1)
    await recorder.stop()
    with pytest.raises(Refused):
        await recorder.stop()
    recorder.start(tmp_path / "b.mp4")
    await lockstep.advance(0.1)
    assert (await recorder.stop()).path.name == "b.mp4"


async def test_recording_ends_by_itself_when_long_enough(recorder, camera, lockstep, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "SECONDS_MAX", 0.5)
    recorder.start(tmp_path / "long.mp4")
    await lockstep.advance(2.0)
    assert not recorder.recording
    assert camera.taken < 20
    assert (await recorder.stop()).seconds == pytest.approx(0.5, abs=0.05)


async def test_stopped_at_once_it_has_one_picture(recorder, lockstep, tmp_path):
    recorder.start(tmp_path / "short.mp4")
    stopping = asyncio.ensure_future(recorder.stop())
    await asyncio.sleep(0)
    with pytest.raises(Refused):
        await recorder.stop()  # it is stopping already
    await lockstep.advance(0.1)
    assert (await stopping).size > 0
    with av.open(str(tmp_path / "short.mp4")) as file:
        assert sum(1 for _ in file.decode(video=0)) >= 1


async def test_an_end_at_once_takes_no_robot_time(recorder, lockstep, tmp_path):
    recorder.start(tmp_path / "none.mp4")
    async with asyncio.timeout(60):
        with pytest.raises(RobotError, match="the recording failed"):
            await recorder.stop(at_once=True)  # no picture came
        recorder.start(tmp_path / "some.mp4")
        await lockstep.advance(0.1)
        assert (await recorder.stop(at_once=True)).size > 0
    assert [entry.name for entry in tmp_path.iterdir()] == ["some.mp4"]


async def test_stop_of_a_caller_that_leaves_ends_it(recorder, lockstep, tmp_path, caplog):
    caplog.set_level("INFO", logger=module.__name__)
    recorder.start(tmp_path / "a.mp4")
    writing = recorder._writing
    stopping = asyncio.ensure_future(recorder.stop())
    await asyncio.sleep(0)
    stopping.cancel()
    await lockstep.advance(1.0)
    assert writing.done()
    assert "a recording failed: the camera sent no picture" in caplog.text


@pytest.mark.parametrize("where", ["nowhere/a.mp4", "a.mp4"])
async def test_a_failure_is_reported_and_leaves_nothing(recorder, lockstep, tmp_path, where):
    recorder.start(tmp_path / where)
    await lockstep.advance(0.1 if "/" in where else 0.0)  # no folder, or no picture
    stopping = asyncio.ensure_future(recorder.stop())
    if "/" not in where:
        recorder._viewer.close()  # the camera ended before its first picture
    await lockstep.advance(0.1)
    with pytest.raises(RobotError, match="the recording failed"):
        await stopping
    assert list(tmp_path.iterdir()) == []


def test_a_still_opens_as_jpeg():
    frame = picture(5)
    with Image.open(io.BytesIO(jpeg(frame))) as image:
        assert (image.format, image.size) == ("JPEG", (WIDTH, HEIGHT))
        assert max(range(0, WIDTH, 4), key=lambda x: image.getpixel((x, 10))[0]) // 8 == 5
    assert len(jpeg(frame, 20)) < len(jpeg(frame, 95))
    with pytest.raises(ValueError, match="quality"):
        jpeg(frame, 100)
