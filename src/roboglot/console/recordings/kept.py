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
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

import msgspec

from roboglot.console.http import SAFETY, Problem, Send, answer
from roboglot.console.settings import COMPARE_SECONDS, DOWNLOAD_BYTES
from roboglot.model.errors import Busy, NotFound, Refused
from roboglot.validation import decode_json

SUFFIX = ".mcap"
REPLAY_ADDRESS = "127.0.0.100"  # hardly ever another robot's
HEAD_RECORDS = 3  # among which the metadata is
_numbered = re.compile(r"(.+)-(\d{3,})")
_part_number = re.compile(r"[1-9][0-9]{0,5}")
REPORT = b"default-src 'none'; style-src 'unsafe-inline'"  # what the page of a comparison may load


class Part(msgspec.Struct, frozen=True):
    """One file of a recording; ``first`` and ``last``: times of its messages, Unix s, None if it has no end."""

    file: str
    bytes: int
    number: int
    first: float | None = None
    last: float | None = None


class Kept(msgspec.Struct, frozen=True):
    """One recording: its parts, robots by name, length (None: not known), and when it was last written, Unix s.

    ``play``: command that plays it back. ``running``: it is being written.
    """

    file: str
    parts: Sequence[Part]
    robots: Sequence[str]
    world: str
    seconds: float | None
    bytes: int
    at: float
    running: bool
    play: str


class RecordingFolder:
    """Recordings of one folder. Methods read files: call those that are not async in a thread."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: dict[tuple[str, int, int], tuple[Part, dict[str, str]]] = {}
        self._comparing = asyncio.Lock()

    def look(self, running: Path | None) -> list[Kept]:
        """Return all recordings, the newest first; ``running``: the file that is being written."""
        found: dict[str, list[tuple[Part, dict[str, str], float]]] = {}
        known = {}
        for path in sorted(self._folder.glob(f"*{SUFFIX}")):
            with suppress(OSError):
                state = path.stat()
                key = path.name, state.st_size, state.st_mtime_ns
                part, facts = known[key] = self._known.get(key) or _outline(path, state.st_size)
                found.setdefault(_base(part), []).append((part, facts, state.st_mtime))
        self._known = known
        kept = [self._kept(members, running) for members in found.values()]
        return sorted(kept, key=lambda one: -one.at)

    def _kept(self, members: Sequence[tuple[Part, dict[str, str], float]], running: Path | None) -> Kept:
        parts = sorted((part for part, _, _ in members), key=lambda part: part.number)
        facts = members[0][1]
        firsts, lasts = [p.first for p in parts if p.first is not None], [p.last for p in parts if p.last is not None]
        robots = _robots(facts)
        whole = len(lasts) == len(parts)
        return Kept(
            parts[0].file,
            parts,
            robots or ([facts["robot"]] if "robot" in facts else []),
            facts.get("world", ""),
            round(max(lasts) - min(firsts), 1) if whole else None,
            sum(part.bytes for part in parts),
            max(at for _, _, at in members),
            running is not None and running.parent == self._folder and running.name in {p.file for p in parts},
            self._play(parts[0].file, robots),
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
        if "/" in file or file.startswith(".") or path.suffix != SUFFIX or path.is_symlink() or not path.is_file():
            raise NotFound(f"there is no recording {file!r}")
        return path

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
        """Send a page that compares two recordings, made by a separate process. Raises RobotError, Problem."""
        if self._comparing.locked():
            raise Busy("another comparison is being made")
        async with self._comparing:
            with TemporaryDirectory(prefix="roboglot-compare-") as folder:
                page = Path(folder) / "page.html"
                options = ["--html", str(page), *(["--robot", robot] if robot else [])]
                await self._run(["compare", *options, "--", self.path(one).name, self.path(other).name])
                body = await asyncio.to_thread(page.read_bytes)
        more = [(b"content-security-policy", REPORT), (b"cache-control", b"no-store")]
        await answer(send, 200, b"text/html; charset=utf-8", body, more)

    async def _run(self, arguments: Sequence[str]) -> None:
        """Run ``roboglot`` in the folder, as reading takes seconds and no robot may wait for it. Raises Problem."""
        process = await asyncio.create_subprocess_exec(
            *("nice", sys.executable, "-m", "roboglot", *arguments),
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


def _robots(facts: Mapping[str, str]) -> list[str]:
    """Return the names of the recorded robots, sorted; none if the file does not tell them in our form."""
    try:
        return sorted(decode_json(facts.get("robots", "{}"), dict[str, object]))
    except msgspec.DecodeError:
        return []


def _base(part: Part) -> str:
    """Return the name that all parts of a recording share."""
    stem = part.file.removesuffix(SUFFIX)
    numbered = _numbered.fullmatch(stem)
    return numbered[1] if numbered and part.number > 1 and int(numbered[2]) == part.number else stem


def _outline(path: Path, size: int) -> tuple[Part, dict[str, str]]:
    """Return a file as a part of a recording, and its metadata; reads only its head and its end. Raises OSError."""
    from roboglot.recording.reader import summary_of

    with path.open("rb") as file:
        summary = summary_of(file)
    facts = _facts(path)
    part = facts.get("part", "")
    number = int(part) if _part_number.fullmatch(part) else 1
    if summary is None or summary.statistics is None:
        return Part(path.name, size, number), facts
    times = summary.statistics.message_start_time / 1e9, summary.statistics.message_end_time / 1e9
    return Part(path.name, size, number, *times), facts


def _facts(path: Path) -> dict[str, str]:
    """Return the metadata at the head of a file; none if it is not a recording of ours. Raises OSError."""
    from mcap.records import Metadata

    from roboglot.recording.reader import BadRecording, records

    with suppress(BadRecording):
        for record, *_ in islice(records(path), HEAD_RECORDS):
            if isinstance(record, Metadata) and record.name == "roboglot":
                return dict(record.metadata)
    return {}
