"""Server of ``roboglot record``: starts and stops recordings, marks moments and reports progress."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec

from roboglot.hosting.local_socket import LocalServer
from roboglot.model.errors import RobotError
from roboglot.validation import decode_json, why_invalid

if TYPE_CHECKING:
    from roboglot.recording.recorder import Recorder

NAME = "record.sock"  # in the data folder


class Request(msgspec.Struct, forbid_unknown_fields=True):
    """Request. ``text``: the path to record to, or to save the last minutes to; the words of a mark."""

    do: Literal["look", "start", "stop", "mark", "save"] = "look"
    text: str = ""


class Answer(msgspec.Struct):
    """State of the recording, and the reason of a refusal (empty: granted)."""

    on: bool = False
    path: str = ""
    seconds: float = 0.0
    bytes: int = 0
    entries: int = 0
    dropped: int = 0
    failure: str = ""
    ring: bool = False
    error: str = ""


class RecordServer(LocalServer):
    """Recording server of one program; ``recorder`` makes its recorder on first use."""

    def __init__(self, folder: Path, recorder: Callable[[], Recorder]) -> None:
        self._recorder = recorder
        super().__init__(folder / NAME, "roboglot record", self._receive)

    async def _receive(self, line: bytes) -> bytes:
        try:
            answer = await self._grant(decode_json(line, Request))
        except (msgspec.DecodeError, RobotError, OSError, ValueError) as refused:
            answer = Answer(error=why_invalid(refused, "the request", wanted=Request) or type(refused).__name__)
        return msgspec.json.encode(answer)

    async def _grant(self, request: Request) -> Answer:
        recorder = self._recorder()
        status = recorder.status
        match request.do:
            case "start":
                recorder.start(request.text)
                status = recorder.status
            case "stop":
                status = await recorder.stop()
            case "mark":
                recorder.mark(request.text)
            case "save":
                recorder.save_ring(Path(request.text))
        return msgspec.convert(status, Answer, from_attributes=True)
