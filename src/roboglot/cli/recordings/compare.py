"""``roboglot compare``: compares two recordings or robots."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Collection, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboglot.cli.numbers import finite
from roboglot.hosting.error_text import in_words

if TYPE_CHECKING:
    from roboglot.model.tap import Exchange
    from roboglot.recording.comparing.comparison import Comparison
    from roboglot.recording.comparing.masks import Mask


class Basis(StrEnum):
    """Basis of a comparison."""

    VALUES = "values"
    BEHAVIOUR = "behaviour"


class Warnings(logging.Handler):
    """Warnings of readers: a report without them would take a recording that was cut off for a short one."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a warning."""
        if (line := record.getMessage()) not in self.lines:
            self.lines.append(line)


def command(
    one: Annotated[str, typer.Argument(help="A recording, or a robot's URL.")],
    other: Annotated[str, typer.Argument(help="A recording or URL to compare it with.")],
    by: Annotated[
        Basis | None,
        typer.Option(
            help="values: every value, place and action; behaviour: fields, units, rates and times (always for URLs)."
        ),
    ] = None,
    robot: Annotated[str, typer.Option(help="Only this robot; needed if there are several.")] = "",
    door: Annotated[str, typer.Option(help="Only the messages of this protocol.")] = "",
    commands: Annotated[
        bool, typer.Option("--commands", help="Also send recorded requests that move or change the robot.")
    ] = False,
    mask: Annotated[Path | None, typer.Option(help="TOML file with rules for the comparison of fields.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Compare every number and time exactly.")] = False,
    html: Annotated[Path | None, typer.Option(help="Write an HTML report to this file.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write a JUnit report to this file.")] = None,
    at_least: Annotated[
        float,
        typer.Option(
            min=0, max=100, callback=finite, help="Exit with 1 if fewer percent agree, or nothing was compared."
        ),
    ] = 100.0,
) -> None:
    """Compare two recordings or robots. A robot gets the recording's requests, or all that change nothing."""
    from roboglot.clients.errors import ClientError
    from roboglot.recording.comparing import reports
    from roboglot.recording.comparing.masks import STRICT, Mask, read_mask

    warnings = Warnings()
    logging.getLogger("roboglot.recording").addHandler(warnings)
    try:
        used = STRICT if strict else read_mask(mask) if mask else Mask()
        comparison = asyncio.run(compared((one, other), by, robot, door, used, commands=commands))
        comparison.robot, comparison.notes = robot, warnings.lines
        if html:
            html.write_text(reports.page(comparison, (one, other)), encoding="utf-8")
        if junit:
            junit.write_bytes(reports.junit(comparison))
    except (OSError, ValueError, ClientError) as error:
        print(f"roboglot compare: {in_words(error)}", file=sys.stderr)
        raise typer.Exit(2) from None
    finally:
        logging.getLogger("roboglot.recording").removeHandler(warnings)
    print(reports.table(comparison))
    sys.exit(not comparison.passes(at_least))


async def compared(
    names: tuple[str, str], by: Basis | None, robot: str, door: str, mask: Mask, *, commands: bool
) -> Comparison:
    """Compare the recordings or robots of two names. Raises ClientError, ValueError, OSError."""
    from roboglot.recording.comparing.behaviour import compare_behaviour
    from roboglot.recording.comparing.comparison import answers_only, compare

    live = ["://" in name for name in names]
    if not any(live) and by is not Basis.BEHAVIOUR:
        from roboglot.recording.comparing.recordings import compare_recordings

        return compare_recordings(Path(names[0]), Path(names[1]), mask, robot, door)
    one, other = await _sessions(names, live, robot, door, commands=commands)
    if any(live):
        one, other = answers_only(one), answers_only(other)
    comparison = compare(one, other, mask, order=False) if by is Basis.VALUES else compare_behaviour(one, other, mask)
    comparison.reason = "a robot at a URL only answers" if any(live) else "--by behaviour leaves single places out"
    return comparison


async def _sessions(
    names: tuple[str, str], live: Sequence[bool], robot: str, door: str, *, commands: bool
) -> Sequence[Sequence[Exchange]]:
    """Return both sessions; robots are asked one after the other. Raises ClientError, ValueError, OSError."""
    from roboglot.cli.recordings.read_only import askable, reads
    from roboglot.model.clock import RealClock
    from roboglot.recording.lines import Target
    from roboglot.recording.probing import asked_again, probe
    from roboglot.recording.reader import read_recording
    from roboglot.recording.replaying import sendable

    targets = {name: Target(name) for name, is_live in zip(names, live, strict=True) if is_live}
    door = door or next((target.door for target in targets.values()), "")
    if any(target.door != door for target in targets.values()):
        raise ValueError("both robots must be asked in one protocol")
    recorded: dict[str, Sequence[Exchange]] = {
        name: read_recording(Path(name)).session(robot, door) for name in names if name not in targets
    }
    if targets:
        recorded = {name: sendable(session)[0] for name, session in recorded.items()}
    if targets and not commands:
        recorded = {name: _reads_only(name, session, reads(door)) for name, session in recorded.items()}
    clock = RealClock()

    async def session(name: str) -> Sequence[Exchange]:
        if name in recorded:
            return recorded[name]
        for questions in recorded.values():
            return await asked_again(questions, targets[name], clock)
        return await probe(targets[name], askable(door), clock)

    return [await session(name) for name in names]


def _reads_only(name: str, session: Sequence[Exchange], reads: Collection[str]) -> Sequence[Exchange]:
    """Return the read-only part of a recording. Raises ValueError if only the rest has requests."""
    from roboglot.recording.probing import reads_only

    kept = reads_only(session, reads)
    if session and not kept:
        raise ValueError(f"{name} has only requests that move or change the robot; --commands sends them, too")
    return kept
