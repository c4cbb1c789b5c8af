"""``roboglot campaign``: scenarios with many seeds, on all cores, into one table and one report."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboglot.cli.numbers import finite
from roboglot.extras import MissingExtra
from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import visible

if TYPE_CHECKING:
    from roboglot.testing.campaign.local import Ended, Leave
    from roboglot.testing.campaign.table import Table
    from roboglot.testing.campaign.trials import Result, Trial

    Player = Callable[[Iterator[Trial], Leave, Ended], None]

SEEDS_MAX = 100_000
FIRST_SEED_MAX = 1 << 53  # the table for data tools has 64 bits
LONGEST_MAX = 7 * 86_400.0  # s
OUT = Path("campaign")
SHOWN_MAX = 10  # scenarios that are listed
KEPT_MAX = 10  # trials per scenario that keep recordings, maps and messages


def command(
    paths: Annotated[list[Path], typer.Argument(help="Scenario files, or folders with them.")],
    seeds: Annotated[int, typer.Option(min=1, max=SEEDS_MAX, help="Number of seeds for each scenario.")] = 100,
    first_seed: Annotated[int, typer.Option(min=0, max=FIRST_SEED_MAX, help="First seed.")] = 1,
    workers: Annotated[
        int, typer.Option(min=0, max=10_000, help="Number of trials at once; 0: one for each processor.")
    ] = 0,
    on: Annotated[
        str,
        typer.Option(
            help="Run trials as tasks of Ray: local, ray://HOST, HOST:PORT or auto; else in forked processes."
        ),
    ] = "",
    out: Annotated[
        Path, typer.Option(help="Folder for table and report; trials already in it are not repeated.")
    ] = OUT,
    longest: Annotated[
        float,
        typer.Option(min=1, max=LONGEST_MAX, callback=finite, help="Longest duration of a trial, in real seconds."),
    ] = 600.0,
) -> None:
    """Play scenarios with many seeds. Ctrl-C (or SIGTERM) keeps the results so far; the same command resumes."""
    from roboglot.testing.campaign.table import OtherCampaign, Table
    from roboglot.testing.campaign.trials import trials_of
    from roboglot.testing.scenarios import files

    try:
        found = files.find([path.absolute() for path in paths])
        folder = Path(os.path.commonpath([each.path.parent for each in found]))
        table = Table(out.absolute() / "table.csv")
        trials = list(trials_of(found, folder, range(first_seed, first_seed + seeds)))
        left = [trial for trial in trials if not table.done(trial)]
    except (files.BadScenario, OtherCampaign, OSError) as bad:
        print(f"roboglot campaign: {visible(in_words(bad))}", file=sys.stderr)
        raise typer.Exit(2) from None
    print(_read(folder, [trial.label for trial in trials[: len(found)]]))
    if len(left) < len(trials):
        print(f"{len(trials) - len(left)} of {len(trials)} trials are in {table.path} already")
    try:
        interrupted = _play(left, table, _player(on, [each.path.parent for each in found], workers, longest))
        passed = _write(table, folder, trials)
    except (MissingExtra, OSError, ValueError) as bad:
        print(f"roboglot campaign: {visible(in_words(bad))}", file=sys.stderr)
        if table.rows:
            with suppress(OSError):  # a full disk may be what ended it
                _write(table, folder, trials)
            print("the same command resumes", file=sys.stderr)
        with suppress(OSError):
            table.close()
        raise typer.Exit(2) from None
    if interrupted:
        raise typer.Exit(130)
    raise typer.Exit(0 if passed else 1)


def _read(folder: Path, names: Sequence[str]) -> str:
    """Return the sentence about the scenarios that were found."""
    more = f" and {len(names) - SHOWN_MAX} more" if len(names) > SHOWN_MAX else ""
    shown = f"{', '.join(names[:SHOWN_MAX])}{more}"
    return visible(f"{len(names)} scenario{'s' * (len(names) > 1)} of {folder}: {shown}")


def _player(on: str, folders: Sequence[Path], workers: int, longest: float) -> Player:
    """Return the player of trials: the given cluster, or this machine. Raises MissingExtra."""
    if on:
        from roboglot.testing.campaign.cluster import play_on

        unique = [folder for folder in folders if not any(other in folder.parents for other in folders)]
        return lambda trials, leave, ended: play_on(
            on, trials, dict.fromkeys(unique), workers, longest, leave=leave, ended=ended
        )
    from roboglot.testing.campaign.local import play_here

    here = workers or os.cpu_count() or 1
    return lambda trials, leave, ended: play_here(trials, here, longest, leave, ended)


def _play(left: list[Trial], table: Table, player: Player) -> bool:
    """Play the remaining trials and print a line for each failure; return True if interrupted."""
    from roboglot.testing.campaign.trials import Outcome

    kept: Counter[str] = Counter()
    number, output = 0, sys.stdout  # a cluster has it print to standard error

    def leave(trial: Trial) -> Path | None:
        return table.path.parent / "failures" / f"seed-{trial.seed}" if kept[trial.scenario] < KEPT_MAX else None

    def ended(trial: Trial, result: Result) -> None:
        nonlocal number
        number += 1
        table.add(trial, result)
        if result.outcome is not Outcome.PASSED:
            kept[trial.scenario] += 1
            print(
                f"{result.outcome:7} {visible(trial.label)} seed {trial.seed}: {visible(result.why)}",
                file=output,
                flush=True,
            )
        if sys.stderr.isatty():
            print(f"\r{number} of {len(left)}", end="", file=sys.stderr, flush=True)

    try:
        player(iter(left), leave, ended)
    except KeyboardInterrupt:
        print(f"\ninterrupted: {number} of {len(left)} trials were played; the same command resumes", file=sys.stderr)
        return True
    return False


def _write(table: Table, folder: Path, trials: Sequence[Trial]) -> bool:
    """Write the report on ``trials`` and, if pyarrow is installed, the table for data tools; return if all passed."""
    from roboglot.testing.campaign.report import report
    from roboglot.testing.campaign.table import write_parquet
    from roboglot.text_files import replacing

    wanted = {(trial.label, trial.seed) for trial in trials}  # the table may hold further ones
    rows = [row for row in table.rows if (row.scenario, row.seed) in wanted]
    page = table.path.with_name("report.md")
    with replacing(page) as fresh:
        fresh.write_text(report(rows, folder, len(trials)), encoding="utf-8")
    written = [str(table.path), str(page)]
    if write_parquet(table.rows, parquet := table.path.with_suffix(".parquet")):
        written.append(str(parquet))
    passed = sum(row.outcome == "passed" for row in rows)
    print(f"{passed} of {len(rows)} trials passed: {', '.join(written)}")
    table.close()
    return passed == len(rows)
