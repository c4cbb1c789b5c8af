"""Records all robots of one program: into files, or only the last minutes into memory, saved when a fault occurs."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from roboglot.config import RecordConfig
from roboglot.model.clock import Clock, LockstepClock
from roboglot.model.components.system.health import FaultLevel
from roboglot.model.errors import RobotError
from roboglot.model.events import FaultRaised
from roboglot.model.inputs.external import ExternalInputs, Input
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage
from roboglot.recording.entries import Entry
from roboglot.recording.files import SUFFIX, Files, Limits, Origin
from roboglot.recording.redaction import FIELDS, Redaction
from roboglot.recording.ring import Ring
from roboglot.recording.sampler import POSE_PERIOD, Sampler, Stamps
from roboglot.recording.thread import WriterThread
from roboglot.recording.truth import TruthSampler
from roboglot.values import dataclass

log = logging.getLogger(__name__)
MARK_MAX = 500  # characters
SAVED_MAX = 50  # files written by a ring on its own
AFTER_FAULT = 2.0  # s of robot time after a fault that still belong to its file
DROPS_PERIOD = 10.0  # s between two warnings


class NotRecording(RobotError):
    """No recording is running, or one already is, or it cannot be written."""


@dataclass(frozen=True, slots=True)
class Status:
    """Progress of a recording. ``path`` is empty if only the ring is kept."""

    on: bool
    path: str = ""
    seconds: float = 0.0
    bytes: int = 0
    entries: int = 0
    dropped: int = 0
    failure: str = ""
    ring: bool = False


class Recorder:
    """Recorder of one program. Idle until ``start``, which begins a recording; ``stop`` ends it."""

    def __init__(
        self,
        config: RecordConfig,
        robots: Mapping[str, Robot],
        stage: Stage | None,
        clock: Clock,
        origin: Origin,
        inputs: ExternalInputs | None = None,
    ) -> None:
        """``inputs``: inputs that change the world."""
        self._inputs = inputs
        self._looking: list[Callable[[], None]] = []  # functions that end it
        self._config, self._robots, self._stage, self._clock, self._origin = config, robots, stage, clock, origin
        self._redaction = Redaction((*FIELDS, *config.redact))
        self._files: Files | None = None
        self._thread: WriterThread | None = None
        self._ring: Ring | None = None
        self._ring_thread: WriterThread | None = None
        self._samplers: list[Sampler] = []
        self._truth: TruthSampler | None = None
        self._sampling: asyncio.Task[None] | None = None
        self._handler: _LogHandler | None = None
        self._began = 0.0
        self._saved = 0
        self._leave: list[Callable[[], None]] = []
        self._warned = 0.0

    # -- files --

    @property
    def status(self) -> Status:
        """Current progress."""
        files, thread = self._files, self._thread
        if files is None or thread is None:
            return Status(False, ring=self._ring is not None)
        seconds = self._clock.time() - self._began
        return Status(
            True,
            str(files.path),
            seconds,
            files.size,
            files.written,
            thread.dropped,
            thread.failure,
            self._ring is not None,
        )

    def start(self, to: str = "") -> Path:
        """Record into a file, or a folder (an existing one, or a path that ends in a slash); return the file.

        Raises NotRecording if a recording runs already or the file cannot be written.
        """
        if self._files is not None:
            raise NotRecording(f"a recording is under way: {self._files.path}")
        target = self._target(to or self._config.to or ".")
        limits = Limits(self._config.part_bytes, self._config.part_seconds, self._config.total_bytes)
        files = Files(target, self._origin, self._redaction, limits)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            files.open(self._stamp()[0])
        except OSError as error:
            raise NotRecording(f"{error.filename or target} cannot be written: {error.strerror}") from None
        self._files = files
        self._thread = WriterThread(files, patient=isinstance(self._clock, LockstepClock))
        self._began = self._clock.time()
        self._look_at_robots()
        log.info("recording to %s", files.path)
        return files.path

    async def stop(self) -> Status:
        """End the recording; return its final status. Raises NotRecording."""
        if self._files is None or self._thread is None:
            raise NotRecording("no recording is under way")
        thread, files = self._thread, self._files
        self._thread = None
        self._look_away_if_idle()
        await asyncio.to_thread(thread.close)
        status = Status(
            False,
            str(files.path),
            self._clock.time() - self._began,
            files.size,
            files.written,
            thread.dropped,
            thread.failure,
            self._ring is not None,
        )
        self._files = None
        early = f", until it ended early: {thread.failure}" if thread.failure else ""
        log.info("recorded %d values in %d bytes to %s%s", files.written, files.size, files.path, early)
        return status

    async def discard(self) -> None:
        """End the recording, if there is one, and delete it."""
        if self._files is not None:
            await asyncio.to_thread(Path((await self.stop()).path).unlink, missing_ok=True)

    def mark(self, text: str) -> None:
        """Record a person's remark at the current time. Raises NotRecording."""
        if self._thread is None and self._ring_thread is None:
            raise NotRecording("no recording is under way")
        at, wall = self._stamp()
        self._put(Entry("/marks", "mark", at, wall, {"text": text[:MARK_MAX]}))

    def _target(self, to: str) -> Path:
        path = Path(to)
        if to.endswith("/") or path.is_dir():
            now = datetime.now(UTC)
            return _free(path / f"roboglot-{now:%Y%m%d-%H%M%S}{SUFFIX}")
        return path if path.suffix == SUFFIX else path.with_name(path.name + SUFFIX)

    # -- the ring --

    def keep_ring(self, folder: Path) -> None:
        """Keep the last minutes in memory from now on.

        They are written into ``folder`` at a robot's new fault, and at an uncaught exception of this program.
        """
        if self._ring is not None:
            return
        self._ring = Ring(self._origin, self._redaction, self._config.ring_seconds)
        self._ring_thread = WriterThread(self._ring, patient=isinstance(self._clock, LockstepClock))

        def note(event: FaultRaised) -> None:
            if event.fault.level > FaultLevel.WARNING:
                self._clock.call_later(AFTER_FAULT, lambda: self._save_by_itself(folder, event.fault.name))

        self._leave += [robot.events.listen(FaultRaised, note) for robot in self._robots.values()]
        self._leave.append(self._watch_loop(folder))
        self._look_at_robots()

    def _watch_loop(self, folder: Path) -> Callable[[], None]:
        """Save the ring at an uncaught exception of the event loop; return a function that ends that."""
        loop = asyncio.get_running_loop()
        before = loop.get_exception_handler()

        def handle(loop: asyncio.AbstractEventLoop, context: dict[str, object]) -> None:
            if isinstance(context.get("exception"), Exception):
                self._save_by_itself(folder, f"crash {type(context['exception']).__name__}")
            if before is None:
                loop.default_exception_handler(context)
            else:
                before(loop, context)

        loop.set_exception_handler(handle)
        return lambda: loop.set_exception_handler(before) if loop.get_exception_handler() is handle else None

    def save_ring(self, path: Path) -> int:
        """Write the last minutes to ``path``; return the number of values. Raises NotRecording, OSError."""
        if self._ring is None or self._ring_thread is None:
            raise NotRecording("the last minutes are not in memory: start with --record-ring")
        self._ring_thread.settle()
        path.parent.mkdir(parents=True, exist_ok=True)
        return self._ring.save(path)

    def _save_by_itself(self, folder: Path, why: str) -> None:
        if self._ring is None or self._saved >= SAVED_MAX:
            return
        self._saved += 1
        word = "".join(c if c.isalnum() else "-" for c in why)[:40]
        now = datetime.now(UTC)
        path = _free(folder / f"{now:%Y%m%d-%H%M%S}-{word}{SUFFIX}")
        if isinstance(self._clock, LockstepClock):
            self._write_ring(path, why)
        else:
            asyncio.get_running_loop().run_in_executor(None, self._write_ring, path, why)

    def _write_ring(self, path: Path, why: str) -> None:
        try:
            self.save_ring(path)
            log.warning("the last minutes before %s are in %s", why, path)
        except (OSError, NotRecording) as error:
            log.error("cannot write the last minutes before %s: %s", why, error)

    # -- sampling --

    def _look_at_robots(self) -> None:
        if self._samplers:
            self._look_again()
            return
        video, photos = self._config.video, self._config.photos
        self._samplers = [Sampler(robot, self._put, video=video, photos=photos) for robot in self._robots.values()]
        self._truth = TruthSampler(self._stage) if self._stage and self._config.truth else None
        if self._inputs is not None:
            self._looking.append(self._inputs.listen(self._note_input))
        self._handler = _LogHandler(self)
        logging.getLogger("roboglot").addHandler(self._handler)
        self._sampling = asyncio.get_running_loop().create_task(self._sample(), name="recorder")

    def _look_again(self) -> None:
        """Sample all latched values again, for a recording that begins beside another."""
        for sampler in self._samplers:
            sampler.again()
        if self._truth is not None:
            self._truth.again()

    def _look_away_if_idle(self) -> None:
        if self._thread is None and self._ring_thread is None:
            for sampler in self._samplers:
                sampler.close()
            for leave in self._looking:
                leave()
            self._samplers, self._looking = [], []
            if self._handler is not None:
                logging.getLogger("roboglot").removeHandler(self._handler)
            if self._sampling is not None:
                self._sampling.cancel()

    async def _sample(self) -> None:
        beat = 0
        self._beat(beat)
        async for _ in self._clock.every(POSE_PERIOD):
            beat += 1
            self._beat(beat)

    def _beat(self, number: int) -> None:
        found: list[Entry] = []
        for sampler in self._samplers:
            sampler.beat(number, found.append)
        if self._truth is not None:
            self._truth.beat(number, self._stamp()[0], found.append)
        for writing in (self._thread, self._ring_thread):
            if writing is not None:
                writing.put_all(found)
        thread = self._thread
        if thread is None or thread.failure or not thread.dropped:
            return
        if self._clock.time() - self._warned > DROPS_PERIOD:
            self._warned = self._clock.time()
            log.warning("recording: dropped %d values so far, the disk is too slow", thread.dropped)

    def _put(self, entry: Entry) -> None:
        if self._thread is not None:
            self._thread.put(entry)
        if self._ring_thread is not None:
            self._ring_thread.put(entry)

    def _stamp(self) -> tuple[int, int]:
        return Stamps(next(iter(self._robots.values()))).now()

    def _note_input(self, given: Input) -> None:
        self._put(Entry("/inputs", "input", *self._stamp(), given))

    def note_log(self, record: logging.LogRecord) -> None:
        """Record a line of the log."""
        at, wall = self._stamp()
        with contextlib.suppress(Exception):  # a broken log line must not break its logger
            self._put(Entry("/log", "log", at, wall, (record.levelno, record.name, record.getMessage()[:2000])))

    async def close(self) -> None:
        """End the recording, the ring and all sampling."""
        if self._files is not None:
            await self.stop()
        if self._ring_thread is not None:
            thread, self._ring_thread = self._ring_thread, None
            for leave in self._leave:
                leave()
            self._look_away_if_idle()
            await asyncio.to_thread(thread.close)


class _LogHandler(logging.Handler):
    """Passes the program's log to the recording."""

    def __init__(self, recorder: Recorder) -> None:
        super().__init__(logging.INFO)
        self._recorder = recorder

    def emit(self, record: logging.LogRecord) -> None:
        if not record.name.startswith("roboglot.recording"):
            self._recorder.note_log(record)


def _free(path: Path) -> Path:
    """Return ``path``, or one like it that does not exist."""
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return free
