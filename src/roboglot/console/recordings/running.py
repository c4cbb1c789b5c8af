"""The recording of the running program: begun, marked and ended from a page, only in the data folder."""

from __future__ import annotations

import asyncio
import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import msgspec

from roboglot.console.recordings.kept import RecordingFolder, StoredRecording
from roboglot.console.recordings.watching import Watching
from roboglot.model.errors import Refused

if TYPE_CHECKING:
    from roboglot.recording.recorder import Recorder

FOLDER = "recordings"  # in the data folder


class RecordingRequest(msgspec.Struct, forbid_unknown_fields=True):
    """Request of a person; ``text``: text of a mark; ``file``: first file of the recording to be deleted."""

    do: Literal["start", "stop", "mark", "delete"]
    file: Annotated[str, msgspec.Meta(max_length=255)] = ""
    text: Annotated[str, msgspec.Meta(max_length=500)] = ""


class Recordings:
    """Recordings of all robots of one program, which need the right ADMIN on all robots."""

    def __init__(self, data: Path, recorder: Callable[[], Recorder]) -> None:
        self._folder, self._recorder = data / FOLDER, recorder
        self.kept = RecordingFolder(self._folder)
        self.watching = Watching(self.kept, lambda: self._running)

    @property
    def on(self) -> bool:
        """True while all robots are being recorded to a file; False once that failed."""
        status = self._recorder().status
        return status.on and not status.failure

    def look(self) -> dict[str, object]:
        """Return the progress; files by name, without their folders."""
        status = self._recorder().status
        return {
            "on": self.on,
            "file": Path(status.path).name if status.path else "",
            "seconds": round(status.seconds, 1),
            "bytes": status.bytes,
            "dropped": status.dropped,
            "failure": _early(status.failure),
        }

    async def all(self) -> list[StoredRecording]:
        """Return the recordings in the data folder, the newest first."""
        return await asyncio.to_thread(self.kept.look, self._running)

    @property
    def _running(self) -> Path | None:
        status = self._recorder().status
        return Path(status.path) if status.on else None

    async def do(self, request: RecordingRequest) -> dict[str, object]:
        """Begin, mark or end the recording, or delete another. Raises Refused, NotFound."""
        recorder = self._recorder()
        if recorder.status.failure and request.do in ("start", "delete"):
            await recorder.stop()
        match request.do:
            case "start":
                self._folder.mkdir(parents=True, exist_ok=True)
                recorder.start(f"{self._folder}/")
            case "mark":
                if not request.text.strip():
                    raise Refused("a mark needs text")
                if recorder.status.failure:
                    raise Refused(_early(recorder.status.failure))
                recorder.mark(request.text.strip())
            case "delete":
                await asyncio.to_thread(self.kept.remove, request.file, self._running)
            case "stop":
                ended = await recorder.stop()
                return self.look() | {"file": Path(ended.path).name, "bytes": ended.bytes}
        return self.look()


def _early(failure: str) -> str:
    """Return why a recording ended early, in words that pages know; empty: it did not."""
    why = "the disk is full" if failure == os.strerror(errno.ENOSPC) else failure
    words = f"the recording ended early: {why}"
    return words if failure else ""
