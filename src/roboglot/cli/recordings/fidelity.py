"""``roboglot fidelity``: agreement of our doors with published answers of real robots, and with themselves."""

from __future__ import annotations

import asyncio
import re
import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from ipaddress import ip_address
from pathlib import Path
from textwrap import wrap
from typing import Annotated

import msgspec
import typer

from roboglot.cli.recordings.read_only import askable
from roboglot.cli.screen import shortened
from roboglot.config import load_config
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.tap import Exchange
from roboglot.protocols import sections
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.pem_files import FOLDER
from roboglot.recording.comparing.behaviour import compare_behaviour
from roboglot.recording.comparing.reports import percent
from roboglot.recording.comparing.trees import kind_of, leaves, tree
from roboglot.recording.lines import Target
from roboglot.recording.probing import probe
from roboglot.runtime import Runtime
from roboglot.text_files import own_text_of, parse_toml

PAGE = Path("docs/fidelity.md")
PUBLISHED = Path(__file__).with_name("published.toml")
FIRST_ADDRESS = "127.0.211.1"  # others follow
BODY = {"robomaster": "robomaster_ep", "cyberdog": "cyberdog2", "slamware": "universal", "visual": "universal"}
SEEDS = 1, 2
WIDTH = 110
SHOWN_MAX = 60  # characters of a request or an answer


class SessionRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One request, and the known facts of its answer."""

    request: str
    status: str = ""
    pattern: str = ""
    fields: dict[str, str] = {}
    silent: bool = False


class Session(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Requests of one connection, and the source of their answers."""

    door: str
    source: str
    asked: tuple[SessionRequest, ...]


class Verdict(msgspec.Struct, frozen=True):
    """One source: number of its facts that hold at our door, and the others as text."""

    door: str
    source: str
    facts: int
    wrong: tuple[str, ...]


def command(write: Annotated[bool, typer.Option("--write", help="Write docs/fidelity.md.")] = False) -> None:
    """Compare the doors of this version with published answers of real robots, and with themselves."""
    text = asyncio.run(page(FIRST_ADDRESS))
    if write:
        PAGE.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)


def published(door: str = "") -> tuple[Session, ...]:
    """Return the published sessions of real robots, or of those with one protocol."""
    found = parse_toml(own_text_of(PUBLISHED))
    sessions = msgspec.convert(found["session"], tuple[Session, ...])
    return tuple(session for session in sessions if door in ("", session.door))


async def page(first_address: str) -> str:
    """Return the page, the same each time: robots run in lockstep, at addresses from the first one on."""
    doors, sessions = sorted(BODY), defaultdict[str, list[Sequence[Exchange]]](list)
    verdicts: list[Verdict] = []
    for seed in SEEDS:
        async with _Served(first_address, seed) as served:
            for door in doors:
                sessions[door].append(await probe(served.targets[door], askable(door), RealClock()))
            if seed == SEEDS[0]:
                verdicts = [await _judge(session, served) for door in doors for session in published(door)]
    compared = {door: compare_behaviour(found[0], found[1]) for door, found in sessions.items()}
    selves = [(door, sum(row.checks for row in found.rows), found.fidelity) for door, found in compared.items()]
    return _page(verdicts, selves)


async def _judge(session: Session, served: _Served) -> Verdict:
    """Send a real robot's requests to one of ours, and compare the answers."""
    wrong: list[str] = []
    facts = 0
    line = served.targets[session.door].line(RealClock(), lambda _operation, _data: None)
    passing = asyncio.get_running_loop().create_task(_pass(served.clock))
    try:
        await line.open()
        for asked in session.asked:
            operation, payload = _request(session.door, asked.request)
            for good, what in _facts(asked, await line.request(operation, payload, [b"{}"])):
                facts += 1
                if not good:
                    wrong.append(f"`{shortened(asked.request, SHOWN_MAX)}`: {what}")
        await line.close()
    finally:
        passing.cancel()
    return Verdict(session.door, session.source, facts, tuple(wrong))


def _request(door: str, text: str) -> tuple[str, bytes]:
    """Return the operation and the payload, in the tap's form."""
    if door == "slamware":
        head, brace, body = text.partition(" {")
        return head, f"{head}\n\n{brace.strip()}{body}".encode()
    if door == "cyberdog":
        code, _, params = text.partition(" ")
        return code, params.encode()
    return text.rstrip(";"), text.encode()


def _facts(asked: SessionRequest, answers: Sequence[tuple[bytes, str]]) -> list[tuple[bool, str]]:
    """Return, for each known fact, whether it holds, and the received answer."""
    if asked.silent:
        return [(not answers, f"{len(answers)} answers")]
    if not answers:
        return [(False, "no answer")]
    payload, status = answers[0]
    text = payload.decode("utf-8", "replace").strip()
    found: list[tuple[bool, str]] = []
    if asked.status:
        found.append((status == asked.status, f"status {status}"))
    if asked.pattern:
        found.append((re.fullmatch(asked.pattern, text) is not None, f"`{shortened(text, SHOWN_MAX)}`"))
    values: dict[str, object] = dict(leaves(tree(payload)))
    for path, kind in asked.fields.items():
        inner = any(name.startswith((f"{path}.", f"{path}[")) for name in values)
        there = kind_of(values[path]) if path in values else kind if inner else "nothing"
        found.append((there == kind, f"{path} is {there}"))
    return found


class _Served:
    """Robots in lockstep while ``with`` lasts; ``targets``: their doors."""

    def __init__(self, first_address: str, seed: int) -> None:
        self._first_address, self._seed = ip_address(first_address), seed
        self._folder = tempfile.TemporaryDirectory(prefix="roboglot-fidelity-")

    async def __aenter__(self) -> _Served:
        data = Path(self._folder.name)
        bodies = sorted(set(BODY.values()))
        address = {body: str(self._first_address + number) for number, body in enumerate(bodies)}
        values = {
            "data": str(data),
            "world": "empty",
            "lockstep": True,
            "seed": self._seed,
            "robots": [{"name": body, "body": body, "address": address[body]} for body in bodies],
            "console": {"enabled": False},
        }
        self._runtime = Runtime(load_config(None, values, sections()))
        await self._runtime.start()
        assert isinstance(self._runtime.clock, LockstepClock)
        self.clock = self._runtime.clock
        await self.clock.advance(float(self._seed))
        export_client(data / FOLDER, data / "app")
        options = {"cyberdog": f"?certs={data / 'app'}"}
        self.targets = {door: Target(f"{door}://{address[b]}{options.get(door, '')}") for door, b in BODY.items()}
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._runtime.close()
        self._folder.cleanup()


async def _pass(clock: LockstepClock) -> None:
    """Let robot time pass, for answers that need it."""
    while True:
        await clock.advance(0.1)
        await asyncio.sleep(0.005)


def _page(verdicts: Sequence[Verdict], selves: Sequence[tuple[str, int, float]]) -> str:
    by_door: dict[str, list[Verdict]] = defaultdict(list)
    for verdict in verdicts:
        by_door[verdict.door].append(verdict)
    lines = [*HEAD, "## Against published answers of real robots", "", *EXPLAINED, ""]
    lines += ["| protocol | facts | hold | agree |", "|---|---|---|---|"]
    for door, found in sorted(by_door.items()):
        facts = sum(verdict.facts for verdict in found)
        hold = facts - sum(len(verdict.wrong) for verdict in found)
        lines.append(f"| {door} | {facts} | {hold} | {percent(hold / facts)} |")
    for verdict in verdicts:
        hold = verdict.facts - len(verdict.wrong)
        lines += ["", *wrap(f"**{verdict.door}**, {hold} of {verdict.facts}: {verdict.source}", WIDTH)]
        lines += ["", *(f"- {words}" for words in verdict.wrong)] if verdict.wrong else []
    lines += ["", "## Against themselves", "", *THEMSELVES, ""]
    lines += ["| protocol | compared | agree |", "|---|---|---|"]
    lines += [f"| {door} | {checks} | {percent(share)} |" for door, checks, share in selves]
    return "\n".join([*lines, "", *TAIL, ""])


HEAD = (
    "# Fidelity",
    "",
    "For anyone who asks how close our robots are to real ones. After this page you know which answers were compared",
    "with which, and can send a recording of your own robot.",
    "",
    "Generated by `roboglot fidelity --write` from this version's doors; do not edit.",
    "",
)
EXPLAINED = (
    "We have not received a recording of a real robot yet. Instead the doors are compared with answers published by",
    "owners of real robots, with expectations of clients that their authors tried on real robots, and with the open",
    "source of a robot's own software. Each fact (a status, the form of an answer, a field and its type) is checked at",
    "our door with its default settings.",
)
THEMSELVES = (
    "Two of our robots, in worlds with different seeds and ages, get all requests that change nothing, and are",
    "compared by behaviour ([how](recording.md#replay-and-compare)). This shows differences that come from the",
    "comparison itself, not how close a real robot is.",
)
TAIL = (
    "## Against real robots: send a recording",
    "",
    "Five minutes with your robot make the first line of this section:",
    "",
    "1. `roboglot record slamware://ROBOT --listen 127.0.0.9 --to mine.mcap` (or `robomaster://`, `visual://`, or",
    "   [`cyberdog://`](recording.md#a-real-robot)); the app or client then connects to 127.0.0.9. For a phone",
    "   or another machine, listen on an address of this machine that it can reach. Use the robot as usual, then press",
    "   Ctrl-C.",
    "2. `roboglot record info mine.mcap` shows the number of messages of each kind. Passwords, tokens, Wi-Fi",
    "   names and keys, accounts, people's names and faces are replaced by `[redacted]` while recording ([which",
    "   fields](recording.md#limits-and-redaction)), photos and films by zeros; video is left out. Maps, texts that",
    "   the robot speaks, and positions remain. `--redact FIELD` leaves out more.",
    "3. Without a client: `roboglot compare slamware://ROBOT slamware://127.0.0.1 --html report.html` sends your",
    "   robot and a simulated one all requests that change nothing, and prints one number.",
    "4. Open an issue with the file or the report, the robot's model and the version of its firmware.",
)
