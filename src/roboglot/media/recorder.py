"""Records the live video into MP4 files, from the viewers' packets, without a second encoder.

A file gets its name only once it is complete.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from roboglot.media.h264 import TIME_BASE, VideoPacket
from roboglot.media.video import VideoStream, beside
from roboglot.model.clock import Clock
from roboglot.model.components.component import Component
from roboglot.model.errors import Busy, Refused, RobotError
from roboglot.model.feed import Viewer
from roboglot.values import dataclass

if TYPE_CHECKING:
    from av.container import OutputContainer
    from av.stream import Stream

log = logging.getLogger(__name__)
R = TypeVar("R")
SECONDS_MAX = 600.0
BYTES_MAX = 600_000_000
FIRST_PICTURE_MAX = 2.0  # s that ``stop`` waits for one: an encoder takes a moment to start


@dataclass(frozen=True, slots=True)
class Recording:
    """A finished file; ``seconds`` of video."""

    path: Path
    seconds: float
    size: int


class Recorder(Component):
    """Recorder of one recording at a time, which ends at SECONDS_MAX or BYTES_MAX; ``stop`` returns it."""

    def __init__(self, video: VideoStream, clock: Clock) -> None:
        self._video, self._clock = video, clock
        self._writing: asyncio.Task[Recording] | None = None
        self._viewer: Viewer[VideoPacket] | None = None
        self._begun = asyncio.Event()  # set by the first picture

    @property
    def recording(self) -> bool:
        """True while recording."""
        return self._writing is not None and not self._writing.done()

    def start(self, path: Path) -> None:
        """Record into ``path`` (.mp4) from now on. Raises Busy while another recording is under way."""
        if self.recording:
            raise Busy("a recording is under way")
        self._begun = asyncio.Event()
        self._viewer = self._video.subscribe()
        self._writing = asyncio.get_running_loop().create_task(self._write(path, self._viewer), name="recorder")
        self._writing.add_done_callback(_ended)

    async def stop(self, *, at_once: bool = False) -> Recording:
        """End the recording and complete its file, with one picture at least, unless ``at_once``.

        ``at_once`` takes no robot time, for a shutdown with a stopped clock. Raises Refused if there is no recording,
        RobotError if it failed or there is no picture.
        """
        writing, viewer = self._writing, self._viewer
        if writing is None or viewer is None:
            raise Refused("nothing is being recorded")
        self._writing = None
        try:
            if not (writing.done() or at_once):
                with contextlib.suppress(TimeoutError):
                    await self._clock.wait_for(self._begun.wait(), FIRST_PICTURE_MAX)
        finally:
            viewer.close()  # also for a caller that does not wait for the end
        try:
            return await asyncio.shield(writing)
        except OSError as error:
            raise RobotError(f"the recording failed: {error}") from error

    async def _write(self, path: Path, viewer: Viewer[VideoPacket]) -> Recording:
        file = _File(path)
        try:
            with viewer:
                async for packet in viewer:
                    await beside(self._clock, _bound(file.add, packet))
                    self._begun.set()
                    if file.seconds >= SECONDS_MAX or file.size >= BYTES_MAX:
                        log.warning("recording %s reached its largest length or size", path.name)
                        break
            return await beside(self._clock, file.finish)
        finally:
            self._begun.set()  # or there will be none
            file.discard()


def _ended(writing: asyncio.Task[Recording]) -> None:
    """Note a failure, which not everyone who stopped a recording waits to hear."""
    if not writing.cancelled() and (error := writing.exception()):
        log.info("a recording failed: %s", error)


def _bound(add: Callable[[VideoPacket], None], packet: VideoPacket) -> Callable[[], None]:
    return lambda: add(packet)


class _File:
    """An incomplete MP4 file, beside its final path."""

    def __init__(self, path: Path) -> None:
        self._path, self._part = path, path.with_name(f"{path.name}.part")
        self._container: OutputContainer | None = None
        self._track: Stream | None = None
        self._first = 0.0
        self.seconds, self.size = 0.0, 0

    def add(self, packet: VideoPacket) -> None:
        """Append one picture; the first is a keyframe."""
        import av

        track = self._track or self._open(packet)
        assert self._container is not None
        sample = av.Packet(packet.data)
        sample.pts = sample.dts = round((packet.stamp - self._first) / TIME_BASE)
        sample.time_base, sample.is_keyframe, sample.stream = TIME_BASE, packet.keyframe, track
        self._container.mux(sample)
        self.seconds, self.size = packet.stamp - self._first, self.size + len(packet.data)

    def _open(self, packet: VideoPacket) -> Stream:
        """Open the file, with the parameter sets of the first keyframe in the track's header."""
        import av

        self._container = av.open(str(self._part), "w", format="mp4")
        with av.open(io.BytesIO(packet.data), format="h264") as probe:
            self._track = self._container.add_stream_from_template(probe.streams.video[0])
        self._track.time_base = TIME_BASE
        self._first = packet.stamp
        return self._track

    def finish(self) -> Recording:
        """Complete the file and rename it. Raises OSError."""
        if self._container is None:
            raise OSError("the camera sent no picture")
        self._container.close()
        self._container = None
        self._part.replace(self._path)
        return Recording(self._path, self.seconds, self._path.stat().st_size)

    def discard(self) -> None:
        """Remove an incomplete file."""
        if self._container is not None:
            self._container.close()
            self._container = None
        self._part.unlink(missing_ok=True)
