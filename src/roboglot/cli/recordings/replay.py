"""``roboglot replay``: sends recorded requests to a robot again and compares the answers."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Annotated

import typer

from roboglot.cli.numbers import finite
from roboglot.hosting.error_text import in_words


def command(
    file: Annotated[Path, typer.Argument(help="A recording.")],
    against: Annotated[
        str,
        typer.Option(
            metavar="URL",
            help="Robot to send to: slamware://, robomaster:// or visual://HOST, cyberdog://HOST?certs=DIR.",
        ),
    ],
    robot: Annotated[str, typer.Option(help="Robot of the recording; needed if there are several.")] = "",
    fast: Annotated[bool, typer.Option("--fast", help="Send as fast as the answers come.")] = False,
    mask: Annotated[Path | None, typer.Option(help="TOML file with rules for the comparison of fields.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write an HTML report to this file.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write a JUnit report to this file.")] = None,
    at_least: Annotated[
        float,
        typer.Option(
            min=0, max=100, callback=finite, help="Exit with 1 if fewer percent agree, or nothing was compared."
        ),
    ] = 100.0,
) -> None:
    """Send the requests of a recording to a robot, in order and on time. It obeys them: mind where it stands."""
    from roboglot.clients.errors import ClientError
    from roboglot.model.clock import RealClock
    from roboglot.recording.comparing import reports
    from roboglot.recording.comparing.comparison import answers_only, compare
    from roboglot.recording.comparing.ids import IdMap
    from roboglot.recording.comparing.masks import Mask, read_mask
    from roboglot.recording.lines import Target
    from roboglot.recording.probing import first_of
    from roboglot.recording.reader import read_recording
    from roboglot.recording.replaying import Replay, sendable

    try:
        target = Target(against)
        recorded, withheld = sendable(read_recording(file).session(robot, target.door))
        used = read_mask(mask) if mask else Mask()
        live = asyncio.run(Replay(recorded, target, RealClock(), fast=fast).run())
    except* (OSError, ValueError, ClientError) as errors:
        sys.exit(f"roboglot replay: {in_words(first_of(errors))}")
    if withheld:
        print(f"{withheld} requests are not sent, because they contain [redacted]", file=sys.stderr)
    comparison = compare(answers_only(recorded), answers_only(live), used, order=not fast, ids=IdMap())
    comparison.reason = "a replay compares answers"
    try:
        if html:
            html.write_text(reports.page(comparison, (str(file), against)), encoding="utf-8")
        if junit:
            junit.write_bytes(reports.junit(comparison))
    except OSError as error:
        sys.exit(f"roboglot replay: {in_words(error)}")
    print(reports.table(comparison))
    sys.exit(not comparison.passes(at_least))
