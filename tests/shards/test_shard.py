"""A shard that cannot start sends the reason to its supervisor."""

from __future__ import annotations

import errno
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest

from roboglot import runtime
from roboglot.model.errors import RobotError
from roboglot.recording.recorder import NotRecording
from roboglot.shards.messages import MESSAGE_MAX, News, Refusal, pair
from roboglot.shards.shard import Reporter, _serve, settings_of
from roboglot.storage.transactions import DatabaseError


@pytest.mark.parametrize("when", ["made", "started"])
@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (NotRecording("lesson.mcap cannot be written: Permission denied"), None),
        (DatabaseError("the database cannot be reached"), None),
        (OSError(errno.EADDRINUSE, "127.0.0.1:1448 is in use by another program"), "127.0.0.1:1448 is in use by anot"),
        (OSError(errno.EACCES, "Permission denied", "/data/lock"), "/data/lock: Permission denied"),
        (OSError(errno.EMFILE, "Too many open files"), "files that this program may have open are in use"),
    ],
)
async def test_reason_of_a_failed_start_is_reported(
    when: str, error: RobotError | OSError, reason: str | None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    async def fail() -> None:
        raise error

    async def close() -> None:
        pass

    def made(*_: object, **__: object) -> SimpleNamespace:
        if when == "made":
            raise error
        return SimpleNamespace(start=fail, close=close)

    monkeypatch.setattr(runtime, "Runtime", made)
    ours, theirs = pair()
    with ours, theirs:
        assert await _serve(settings_of({"data": str(tmp_path)}), Reporter(theirs), None) == 1
        refusal = msgspec.json.decode(ours.recv(MESSAGE_MAX), type=News)
    assert isinstance(refusal, Refusal)
    assert (reason or str(error)) in refusal.reason
    assert not refusal.lasting
