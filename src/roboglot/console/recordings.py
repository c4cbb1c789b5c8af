"""The recording of the running program: begun, marked and ended from a page, into the data folder alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import msgspec

from roboglot.model.errors import Refused

if TYPE_CHECKING:
    from roboglot.recording.recorder import Recorder

FOLDER = "recordings"  # in the data folder


class RecordingWish(msgspec.Struct, forbid_unknown_fields=True):
    """Request of a person; ``text``: a mark's words."""

    do: Literal["start", "stop", "mark"]
    text: Annotated[str, msgspec.Meta(max_length=500)] = ""


class Recordings:
    """Recordings of all robots of one program; so they need the right to admin on all robots."""

    def __init__(self, data: Path, recorder: Callable[[], Recorder]) -> None:
        self._folder, self._recorder = data / FOLDER, recorder

    @property
    def on(self) -> bool:
        """True while everything that robots say, hear, see and do is being written to a file."""
        return self._recorder().status.on

    def look(self) -> dict[str, object]:
        """Return the progress; files by their names, not by where they are."""
        status = self._recorder().status
        return {
            "on": status.on,
            "file": Path(status.path).name if status.path else "",
            "seconds": round(status.seconds, 1),
            "bytes": status.bytes,
            "dropped": status.dropped,
            "failure": status.failure,
        }

    async def do(self, wish: RecordingWish) -> dict[str, object]:
        """Begin, mark or end it. Raises Refused."""
        recorder = self._recorder()
        match wish.do:
            case "start":
                self._folder.mkdir(parents=True, exist_ok=True)
                recorder.start(f"{self._folder}/")
            case "mark":
                if not wish.text.strip():
                    raise Refused("a mark needs words")
                recorder.mark(wish.text.strip())
            case "stop":
                ended = await recorder.stop()
                return self.look() | {"file": Path(ended.path).name, "bytes": ended.bytes}
        return self.look()
