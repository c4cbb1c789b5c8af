"""``roboglot test``: scenarios in YAML, each on its own robots, judged by ground truth."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from roboglot.hosting.escaping import visible
from roboglot.testing.artifacts import FOLDER


def command(
    paths: Annotated[list[Path] | None, typer.Argument(help="Scenario files, or folders with them.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write a JUnit report to this file.")] = None,
    failures: Annotated[
        Path, typer.Option(help="Folder for recordings, maps and messages of failed scenarios.")
    ] = Path(FOLDER),
    seed: Annotated[int | None, typer.Option(min=0, help="Seed to play with instead of the files'.")] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON schema of scenario files.")] = False,
) -> None:
    """Play scenarios (given, when, then) on simulated robots: see docs/testing.md."""
    from roboglot.testing.scenarios import files, runner

    if schema:
        print(json.dumps(files.schema(), indent=1))
        return
    if not paths:
        raise typer.BadParameter("name scenario files or folders")
    try:
        found = files.find(paths)
        if seed is not None:
            found = [files.with_seed(each, seed) for each in found]
    except files.BadScenario as bad:
        print(f"roboglot test: {visible(str(bad))}", file=sys.stderr)
        raise typer.Exit(2) from None

    def report(outcome: runner.Outcome) -> None:
        word = "FAILED" if outcome.failures else "ok"
        print(f"{word:6} {visible(outcome.found.scenario.name)} ({outcome.seconds:.1f} s)", flush=True)
        for failure in outcome.failures:
            print("".join(f"       {visible(line)}\n" for line in failure.splitlines()), end="")
        for path in outcome.left:
            print(f"       {path}")

    outcomes = runner.play_all(found, failures.absolute(), report)
    if junit is not None:
        junit.parent.mkdir(parents=True, exist_ok=True)
        junit.write_bytes(runner.junit(outcomes))
    failed = sum(bool(outcome.failures) for outcome in outcomes)
    print(f"{len(outcomes) - failed} of {len(outcomes)} scenarios passed")
    raise typer.Exit(1 if failed else 0)
