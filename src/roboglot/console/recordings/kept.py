"""Recordings in the data folder: listed with robots, length, date and size; compared, deleted, sent to a browser."""

from __future__ import annotations

import asyncio
import os
import re
import shlex
import signal
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

import msgspec

from roboglot.console.http import SAFETY, Problem, Send, answer
from roboglot.console.settings import COMPARE_MEMORY, COMPARE_SECONDS, DOWNLOAD_BYTES
from roboglot.model.errors import Busy, NotFound, Refused
from roboglot.values import dataclass

SUFFIX = ".mcap"
REPLAY_ADDRESS = "127.0.0.100"  # hardly ever another robot's
HEAD_RECORDS = 3  # among which the metadata is
_numbered = re.compile(r"(.+)-(\d{3,})")
_whole = re.compile(r"[0-9]{1,9}")
REPORT = b"default-src 'none'; style-src 'unsafe-inline'"  # what the page of a comparison may load


class RecordingPart(msgspec.Struct, frozen=True):
    """One file of a recording; ``first`` and ``last``: times of its messages, Unix s, None if it has no end.

    ``begun``: when it was begun, by the clock of the machine that wrote it, Unix s; of older files without a date, when
    they were last written. ``damage``: why the head is not read, empty if it is.
    """

    file: str
    bytes: int
    number: int
    begun: float
    first: float | None = None
    last: float | None = None
    damage: str = ""


class StoredRecording(msgspec.Struct, frozen=True):
    """One recording: its parts, robots by name, length (None: not known), and when it was begun, Unix s.

    ``play``: command that plays it back. ``running``: it is being written. ``damage``: why it is not read.
    """

    file: str
    parts: Sequence[RecordingPart]
    robots: Sequence[str]
    world: str
    seconds: float | None
    bytes: int
    at: float
    running: bool
    play: str
    damage: str = ""


@dataclass(frozen=True, slots=True)
class _Outline:
    """A part, and what its head says."""

    part: RecordingPart
    robots: Sequence[str]
    world: str


class RecordingFolder:
    """Recordings of one folder. Methods read files: call those that are not async in a thread."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: dict[tuple[str, int, int], _Outline] = {}
        self._comparing = asyncio.Lock()
        self._compared: tuple[object, bytes] | None = None  # the last comparison: of these files, its page

    def look(self, running: Path | None) -> list[StoredRecording]:
        """Return all recordings, the newest first; ``running``: the file that is being written."""
        found: dict[str, list[_Outline]] = {}
        known = {}
        for path in sorted(self._folder.glob(f"*{SUFFIX}")):
            with suppress(OSError):
                state = path.stat()
                key = path.name, state.st_size, state.st_mtime_ns
                one = known[key] = self._known.get(key) or _outline(path, state)
                found.setdefault(_base(one.part), []).append(one)
        self._known = known
        kept = [self._kept(members, running) for members in found.values()]
        return sorted(kept, key=lambda one: -one.at)

    def _kept(self, members: Sequence[_Outline], running: Path | None) -> StoredRecording:
        members = sorted(members, key=lambda one: one.part.number)
        parts, head = [one.part for one in members], members[0]
        firsts, lasts = [p.first for p in parts if p.first is not None], [p.last for p in parts if p.last is not None]
        whole = len(lasts) == len(parts)
        return StoredRecording(
            head.part.file,
            parts,
            head.robots,
            head.world,
            round(max(lasts) - min(firsts), 1) if whole else None,
            sum(part.bytes for part in parts),
            min(part.begun for part in parts),
            running is not None and running.parent == self._folder and running.name in {p.file for p in parts},
            self._play(head.part.file, head.robots),
            next((part.damage for part in parts if part.damage), ""),
        )

    def _play(self, file: str, robots: Sequence[str]) -> str:
        which = f"#{robots[0]}" if len(robots) > 1 else ""
        given = shlex.quote(f"{robots[0] if robots else 'a'}=recording:{self._folder / file}{which}")
        data = shlex.quote(f"{self._folder.parent}-replay")
        command = shlex.quote(str(Path(sys.executable).with_name("roboglot")))
        return f"{command} up --address {REPLAY_ADDRESS} --robot {given} --data {data}"

    def path(self, file: str) -> Path:
        """Return the path of a file. Raises NotFound."""
        path = self._folder / file
        known = "/" not in file and not file.startswith(".") and path.suffix == SUFFIX
        with suppress(OSError):  # no file can have such a name
            if known and not path.is_symlink() and path.is_file():
                return path
        raise NotFound(f"there is no recording {file!r}")

    def remove(self, file: str, running: Path | None) -> None:
        """Delete a recording with all its parts. Raises NotFound, Refused."""
        found = next((one for one in self.look(running) if one.file == file), None)
        if found is None:
            raise NotFound(f"there is no recording {file!r}")
        if found.running:
            raise Refused(f"{file} is being written: end the recording first")
        try:
            for part in reversed(found.parts):
                self.path(part.file).unlink()
        except OSError as error:
            raise Refused(f"{file} cannot be deleted: {error.strerror}") from None

    async def send(self, file: str, send: Send) -> None:
        """Send a file, a piece at a time. Raises NotFound."""
        path = self.path(file)
        with path.open("rb") as source:
            size = os.fstat(source.fileno()).st_size
            headers = [
                (b"content-type", b"application/octet-stream"),
                (b"content-length", b"%d" % size),
                (b"content-disposition", b"attachment"),
                (b"cache-control", b"no-store"),
                *SAFETY,
            ]
            await send({"type": "http.response.start", "status": 200, "headers": headers})
            while size > 0:
                data = await asyncio.to_thread(_piece, source, min(size, DOWNLOAD_BYTES))
                size -= len(data)
                await send({"type": "http.response.body", "body": data, "more_body": size > 0})

    async def send_comparison(self, one: str, other: str, robot: str, send: Send) -> None:
        """Send a page that compares two recordings, made by a separate process. Raises RobotError, Problem.

        The last page is kept, so that a page which has waited for it may open it.
        """
        if self._comparing.locked():
            raise Busy("another comparison is being made")
        async with self._comparing:
            states = [path.stat() for path in (self.path(one), self.path(other))]
            asked = one, other, robot, [(state.st_size, state.st_mtime_ns) for state in states]
            if self._compared is None or self._compared[0] != asked:
                self._compared = asked, await self._compare(one, other, robot)
            body = self._compared[1]
        more = [(b"content-security-policy", REPORT), (b"cache-control", b"no-store")]
        await answer(send, 200, b"text/html; charset=utf-8", body, more)

    async def _compare(self, one: str, other: str, robot: str) -> bytes:
        with TemporaryDirectory(prefix="roboglot-compare-") as folder:
            page = Path(folder) / "page.html"
            options = ["--html", str(page), *(["--robot", robot] if robot else [])]
            await self._run(["compare", *options, "--", one, other])
            try:
                return await asyncio.to_thread(page.read_bytes)
            except OSError:  # it ended as if there were differences
                raise Problem(409, "the comparison ended early") from None

    async def _run(self, arguments: Sequence[str]) -> None:
        """Run ``roboglot`` in the folder, as reading takes seconds and no robot may wait for it. Raises Problem."""
        limited = f'ulimit -d {COMPARE_MEMORY >> 10} && exec nice "$@"'
        process = await asyncio.create_subprocess_exec(
            *("sh", "-c", limited, "sh", sys.executable, "-m", "roboglot", *arguments),
            cwd=self._folder,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            start_new_session=True,
        )
        try:
            async with asyncio.timeout(COMPARE_SECONDS):
                _, said = await process.communicate()
        except TimeoutError:
            raise Problem(504, f"the comparison took longer than {COMPARE_SECONDS:g} s") from None
        finally:
            if process.returncode is None:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
        if process.returncode not in (0, 1):
            lines = said.decode("utf-8", "replace").strip().splitlines()
            raise Problem(409, lines[-1].removeprefix("roboglot compare: ") if lines else "the comparison ended early")


def _piece(source: IO[bytes], size: int) -> bytes:
    """Return the next bytes of a file; zeros if it has become shorter since its length was announced."""
    return source.read(size).ljust(size, b"\0")


def _base(part: RecordingPart) -> str:
    """Return the name that all parts of a recording share."""
    stem = part.file.removesuffix(SUFFIX)
    numbered = _numbered.fullmatch(stem)
    return numbered[1] if numbered and part.number > 1 and int(numbered[2]) == part.number else stem


def _outline(path: Path, state: os.stat_result) -> _Outline:
    """Return what the head and the end of a file say. Raises OSError."""
    from roboglot.recording.reader import BadRecording, summary_of

    facts, robots, number, why = dict[str, str](), list[str](), 1, ""
    try:
        path.name.encode()
        facts = _facts(path)
        robots, number = _robots(facts), _number(facts)
    except UnicodeEncodeError:
        why = "its name is not UTF-8: rename the file"
    except BadRecording as error:
        why = str(error).replace(str(path), path.name)
    with path.open("rb") as file:
        summary = summary_of(file)
    first = last = None
    if summary is not None and (found := summary.statistics) is not None:
        first, last = found.message_start_time / 1e9, found.message_end_time / 1e9
    name = path.name.encode("utf-8", "replace").decode()
    part = RecordingPart(name, state.st_size, number, _begun(facts, first) or state.st_mtime, first, last, why)
    return _Outline(part, robots, facts.get("world", ""))


def _facts(path: Path) -> dict[str, str]:
    """Return the metadata at the head of a file. Raises BadRecording, OSError."""
    from mcap.records import Metadata

    from roboglot.recording.reader import BadRecording, records

    for record, *_ in islice(records(path), HEAD_RECORDS):
        if isinstance(record, Metadata) and record.name == "roboglot":
            return dict(record.metadata)
    why = "it does not begin as recordings of roboglot do"
    raise BadRecording(why)


def _robots(facts: Mapping[str, str]) -> list[str]:
    """Return the names of the robots. Raises BadRecording."""
    from roboglot.recording.reader import BadRecording

    if "robots" not in facts:
        return [facts["robot"]] if "robot" in facts else []
    try:
        return sorted(msgspec.json.decode(facts["robots"], type=dict[str, str]))
    except (msgspec.MsgspecError, UnicodeError, RecursionError):
        why = "the list of robots at its head cannot be read"
        raise BadRecording(why) from None


def _number(facts: Mapping[str, str]) -> int:
    """Return the number of a part. Raises BadRecording."""
    from roboglot.recording.reader import BadRecording

    if not _whole.fullmatch(text := facts.get("part", "1")):
        why = "the number of the part at its head cannot be read"
        raise BadRecording(why)
    return int(text)


def _begun(facts: Mapping[str, str], first: float | None) -> float | None:
    """Return when a part was begun, Unix s, None if it is not known; ``first``: robot time of its first message."""
    with suppress(ValueError, OverflowError, KeyError):
        return datetime.fromisoformat(facts["begun"]).timestamp()
    return first if facts.get("clock") == "x1" else None  # other clocks soon tell another time than people's
