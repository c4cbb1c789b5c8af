"""``roboglot compare``: two recordings, value by value, and how much of them agrees."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def command(
    one: Annotated[Path, typer.Argument(help="A recording.")],
    other: Annotated[Path, typer.Argument(help="Another one.")],
    robot: Annotated[str, typer.Option(help="Only this robot; needed where there are several.")] = "",
    door: Annotated[str, typer.Option(help="Only this protocol.")] = "",
    mask: Annotated[Path | None, typer.Option(help="TOML: how which fields are compared.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Every number and time exactly.")] = False,
    html: Annotated[Path | None, typer.Option(help="Write a page.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit's XML.")] = None,
    at_least: Annotated[float, typer.Option(min=0, max=100, help="Fail below so many percent.")] = 100.0,
) -> None:
    """Compare two recordings: status, values and times of answers; pushes; order. Exit status 1: they differ."""
    from roboglot.recording.comparing import reports
    from roboglot.recording.comparing.comparison import compare
    from roboglot.recording.comparing.masks import STRICT, Mask, read_mask
    from roboglot.recording.reader import read_recording

    try:
        used = STRICT if strict else read_mask(mask) if mask else Mask()
        sessions = [read_recording(path).session(robot, door) for path in (one, other)]
        comparison = compare(sessions[0], sessions[1], used)
        if html:
            html.write_text(reports.page(comparison, (str(one), str(other))), encoding="utf-8")
        if junit:
            junit.write_bytes(reports.junit(comparison))
    except (OSError, ValueError) as error:
        sys.exit(f"roboglot compare: {error}")
    print(reports.table(comparison))
    sys.exit(comparison.fidelity * 100 < at_least)
