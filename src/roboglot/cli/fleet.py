"""``roboglot fleet``: run many worlds, each in a separate process, and restart failed ones."""

from __future__ import annotations

import asyncio
import os
import sqlite3
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import msgspec
import typer

from roboglot.cli.control import running
from roboglot.cli.numbers import finite
from roboglot.cli.suggestions import Group
from roboglot.config import default_data_folder
from roboglot.extras import MissingExtra, refuse_without
from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import visible

if TYPE_CHECKING:
    from roboglot.shards.fleet_host import FleetHost
    from roboglot.shards.folder_before import FolderBefore
    from roboglot.shards.nursery_client import StartedNursery
    from roboglot.shards.plan import FleetPlan
    from roboglot.shards.requests import Answer, Row, Verb

app = typer.Typer(
    cls=Group,
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Run many worlds on this machine or on several, each in a process of its own (a shard).",
)
INTERRUPTED = 130  # exit status
PATIENCE = 120.0  # s for a request; stopping and starting 100 shards takes a while
MEGABYTE = 1 << 20
LINES_MAX = 100_000
HEAD = f"{'shard':6} {'state':9} {'pid':>8} {'robots':>6} {'core':>6} {'MB':>6} {'x real':>7} {'restarts':>8}"
Data = Annotated[
    Path | None,
    typer.Option(envvar="ROBOGLOT_FLEET", help="The fleet's folder; by default `fleet` in the data folder."),
]


@app.command()
def up(
    worlds: Annotated[int | None, typer.Option(min=1, help="Number of worlds; needed at the first start.")] = None,
    robots_each: Annotated[
        int | None, typer.Option(min=1, help="Robots in each world, without a template; by default one.")
    ] = None,
    template: Annotated[Path | None, typer.Option(help="Configuration of every world, as for `roboglot up`.")] = None,
    first_address: Annotated[
        str, typer.Option(help="Address of the first robot (127.10.0.1); the others follow it.")
    ] = "",
    memory_max: Annotated[
        int, typer.Option(min=0, help="Memory in MB above which a shard is restarted; 0: no limit.")
    ] = 0,
    replan: Annotated[bool, typer.Option("--replan", help="Make a new plan; moves of robots are forgotten.")] = False,
    on: Annotated[str, typer.Option(help="Run shards as actors of Ray: local, ray://HOST, HOST:PORT or auto.")] = "",
    detached: Annotated[
        bool, typer.Option("--detached", help="With --on: keep shards running when this command ends.")
    ] = False,
    data: Data = None,
) -> None:
    """Start a fleet and keep it up until Ctrl-C; its robots' data stays in its folder."""
    from roboglot.shards.nursery_client import NotWarm, launched
    from roboglot.shards.warm_up import FOREIGN

    if not on:
        refuse_without("roboglot fleet", "up", dict.fromkeys(name.partition(".")[0] for name in ("numba", *FOREIGN)))
    began = time.monotonic()
    with launched(wanted=not on) as nursery:  # it loads while we import what a plan needs
        from roboglot.hosting.folder_lock import FolderInUse
        from roboglot.hosting.logs import set_up_logging
        from roboglot.shards.serving import Interrupted, serve

        set_up_logging(verbose=False)
        folder = _folder(data)
        asked = _PlanOptions(worlds, robots_each, template, first_address)
        try:
            if detached and on in ("", "local"):
                raise ValueError("--detached is for a cluster: --on ray://HOST")
            if memory_max and on:
                raise ValueError("--memory-max is for shards without --on: Ray places and limits its own")
            where = _MachineOptions(on, detached, memory_max << 20, nursery)
            say = partial(print, file=sys.stdout, flush=True)  # also where a cluster has it print to standard error
            with _planned(folder, asked, replan=replan) as (plan, before), _joined(plan, on):  # joining takes long
                asyncio.run(serve(lambda: _fleet_host(plan, folder, where), before, say, began, lasting=detached))
        except Interrupted as early:
            print(f"roboglot fleet: {early}", file=sys.stderr)
            sys.exit(INTERRUPTED)
        except (ValueError, OSError, FolderInUse, NotWarm, MissingExtra) as error:
            sys.exit(f"roboglot fleet: {in_words(error)}")


@app.command("list")
def show(
    data: Data = None, as_json: Annotated[bool, typer.Option("--json", help="Print one JSON text.")] = False
) -> None:
    """Show every shard with its robots and their addresses."""
    answer = _ask("look", data)
    if as_json:
        print(msgspec.json.encode(answer).decode())
        return
    for row in answer.shards:
        print(f"{row.name:6} {row.state:9} {_why(row)}")
        for robot in row.robots:
            print(f"       {robot.name:10} {robot.body:12} {robot.address}")


@app.command()
def top(
    data: Data = None,
    once: Annotated[
        bool | None,
        typer.Option("--once/--watch", help="Print one table and exit (the default in a pipe), or go on."),
    ] = None,
    period: Annotated[
        float,
        typer.Option(
            min=0.5, max=3600, callback=finite, help="Seconds between tables, over which processor time is measured."
        ),
    ] = 2.0,
) -> None:
    """Show each shard's processor time and memory, and whether it keeps up with robot time."""
    terminal = sys.stdout.isatty()
    ends = not terminal if once is None else once
    before = {row.name: (row.pid, row.cpu, time.monotonic()) for row in _ask("look", data).shards}
    while True:
        time.sleep(period)
        answer, now = _ask("look", data), time.monotonic()
        lines = [HEAD]
        for row in answer.shards:
            core = _cores(row, before.get(row.name, (0, 0.0, now)), now)
            lines.append(
                f"{row.name:6} {row.state:9} {row.pid:8} {len(row.robots):6} {core:>6}"
                f" {row.memory / MEGABYTE:6.0f} {row.factor:7.2f} {row.restarts:8}"
            )
            before[row.name] = row.pid, row.cpu, now
        memory = sum(row.memory for row in answer.shards) / MEGABYTE
        robots = sum(len(row.robots) for row in answer.shards)
        lines.append(f"{len(answer.shards)} shards, {robots} robots, {memory:.0f} MB; nursery {answer.nursery}")
        print("\n".join(lines) if ends or not terminal else "\x1b[H\x1b[2J" + "\n".join(lines), flush=True)
        if ends:
            return


def _cores(row: Row, before: tuple[int, float, float], now: float) -> str:
    """Return the cores that a shard used since an earlier report: its process, its processor time and their time.

    A dash if that process had not reported its processor time yet: its start is not of this period.
    """
    pid, cpu, at = before
    if row.pid == pid and not cpu:
        return "-"
    return f"{(row.cpu - (cpu if row.pid == pid else 0.0)) / (now - at) if now > at else 0.0:.2f}"


@app.command()
def stop(
    shard: Annotated[str, typer.Argument(help="A shard, or one of its robots; none: all of them.")] = "",
    data: Data = None,
) -> None:
    """Stop one shard or all; `restart` starts them again."""
    _print(_ask("stop", data, shard=shard), shard)


@app.command()
def restart(
    shard: Annotated[str, typer.Argument(help="A shard, or one of its robots; none: all of them.")] = "",
    data: Data = None,
) -> None:
    """Restart one shard or all, with the same addresses and stored data."""
    _print(_ask("restart", data, shard=shard), shard)


@app.command()
def reset(shard: Annotated[str, typer.Argument(help="A shard, or one of its robots.")], data: Data = None) -> None:
    """Restart a shard empty: programs, maps, places and certificates of its robots are deleted."""
    _print(_ask("reset", data, shard=shard), shard)


@app.command()
def move(
    robot: Annotated[str, typer.Argument(help="The robot's name.")],
    to: Annotated[str, typer.Argument(help="The shard to move it to.")],
    data: Data = None,
) -> None:
    """Move a robot to another shard, with its address and stored data; both shards restart."""
    _print(_ask("move", data, robot=robot, to=to), to)


@app.command()
def where(
    robot: Annotated[str, typer.Argument(help="A robot's name; without it, all.")] = "",
    registry: Annotated[
        str, typer.Option(envvar=["ROBOGLOT_REGISTRY", "ROBOGLOT_DATABASE"], help="The registry's URL or file.")
    ] = "",
) -> None:
    """Show the program that runs a robot, on any machine, with its address and epoch."""
    from roboglot.storage.opening import read_registry
    from roboglot.storage.robot_registry import RobotRegistry
    from roboglot.storage.transactions import FAILURES

    if not registry:
        sys.exit("roboglot fleet: give the registry's URL or file: --registry, or ROBOGLOT_REGISTRY")
    try:
        database = read_registry(registry)
        claims = asyncio.run(RobotRegistry(database).all())
        database.close()
    except (ValueError, OSError, sqlite3.Error, *FAILURES) as error:
        sys.exit(f"roboglot fleet: {in_words(error)}")
    if robot and robot not in claims:
        sys.exit(f"roboglot fleet: the registry knows no robot {robot!r}")
    for claim in [claims[robot]] if robot else claims.values():
        print(f"{claim.robot:10} {claim.address:16} epoch {claim.epoch:<6} {claim.holder or 'released'}")


@app.command()
def logs(
    shard: Annotated[str, typer.Argument(help="A shard, or one of its robots.")],
    lines: Annotated[int, typer.Option("--lines", "-n", min=1, max=LINES_MAX)] = 50,
    data: Data = None,
) -> None:
    """Print the end of a shard's log, even if no fleet is up."""
    from roboglot.shards.plan import load
    from roboglot.shards.states import LOG_FILE

    folder = _folder(data)
    try:
        plan = load(folder)
        if plan is None:
            raise LookupError(f"there is no fleet in {folder}")
        name = plan.find(shard).name
        with (folder / "shards" / name / LOG_FILE).open(encoding="utf-8", errors="replace") as file:
            print(visible("".join(deque(file, lines))), end="")
    except FileNotFoundError:
        sys.exit(f"roboglot fleet: shard {name} has no log yet")
    except (LookupError, ValueError, OSError) as error:
        sys.exit(f"roboglot fleet: {error.args[0] if isinstance(error, LookupError) else in_words(error)}")


def _folder(data: Path | None) -> Path:
    return (data or Path(os.environ.get("ROBOGLOT_DATA") or default_data_folder(os.environ)) / "fleet").absolute()


class _PlanOptions(NamedTuple):
    """Options of a plan; without options: the stored plan."""

    worlds: int | None
    robots_each: int | None
    template: Path | None
    first: str


def _plan(folder: Path, asked: _PlanOptions, *, replan: bool) -> FleetPlan:
    """Return the stored plan, or a new one. Raises ValueError if the stored one has other options."""
    from roboglot.shards.plan import FIRST_ADDRESS, PLAN, load, plan_fleet
    from roboglot.text_files import parse_toml, text_of

    kept = None if replan else load(folder)
    if kept is not None and not any(asked):
        return kept
    if not asked.worlds:
        there = (folder / PLAN).exists()
        why = "options of a plan need --worlds" if there else f"there is no fleet in {folder} yet: give --worlds"
        raise ValueError(why)
    try:
        template = parse_toml(text_of(asked.template)) if asked.template else {}
    except OSError as error:
        raise ValueError(in_words(error)) from None
    except ValueError as error:  # bad TOML, or not UTF-8
        raise ValueError(f"{asked.template}: {error}") from None
    first = asked.first or FIRST_ADDRESS
    plan = plan_fleet(asked.worlds, asked.robots_each or 0, template, folder, first=first)
    if kept is None:
        return plan
    if kept.request != plan.request:
        raise ValueError(f"the fleet in {folder} has another plan: start it without options, or with --replan")
    return kept


@contextmanager
def _planned(folder: Path, asked: _PlanOptions, *, replan: bool) -> Iterator[tuple[FleetPlan, FolderBefore]]:
    """Context with the plan, in which the folder is locked; one that is not there is made for a good plan only.

    If the context fails, the folder is as it was ``before``, unless that is to be kept. Raises FolderInUse, before what
    ``_plan`` raises: another program may be storing its plan. Raises OSError.
    """
    from roboglot.hosting.folder_lock import locked
    from roboglot.shards.folder_before import FolderBefore

    before, there = FolderBefore(folder), folder.is_dir()
    with ExitStack() as held:
        if there:
            held.enter_context(locked(folder))
            before.look()
        try:
            plan = _plan(folder, asked, replan=replan)
            if not there:
                held.enter_context(locked(folder))
                before.look()
            yield plan, before
        except BaseException:
            before.clear()
            raise


class _MachineOptions(NamedTuple):
    """Options of the shards' machines."""

    on: str
    detached: bool
    memory_max: int  # bytes
    nursery: StartedNursery | None


def _joined(plan: FleetPlan, on: str) -> AbstractContextManager[None]:
    """Return a context in the cluster ``on``, if given. Raises MissingExtra, OSError; ValueError for such a plan."""
    if not on:
        return nullcontext()
    from roboglot.shards.cluster import refuse_unfenced
    from roboglot.shards.joining import joined

    refuse_unfenced(plan, on)
    return joined(on)


def _fleet_host(plan: FleetPlan, folder: Path, where: _MachineOptions) -> FleetHost:
    if where.on:
        from roboglot.shards.cluster import ClusterFleet

        return ClusterFleet(plan, folder, where.on, lasting=where.detached)
    from roboglot.shards.supervisor import Supervisor

    return Supervisor(plan, folder, memory_max=where.memory_max, nursery=where.nursery)


def _ask(verb: Verb, data: Path | None, **fields: str) -> Answer:
    """Return the fleet's answer; without one, or after a refusal, end the program with a sentence."""
    from roboglot.shards.requests import SOCKET, Answer, Request
    from roboglot.shards.states import detached_on

    folder = _folder(data)
    absent = f"no fleet is up in {folder}"
    if where := detached_on(folder):
        absent += (
            f"; shards that were started with --detached may still run: `roboglot fleet up --on {where} --detached`"
            " serves them again, and without --detached it stops them when it ends"
        )
    return running.request("fleet", folder / SOCKET, Request(verb, **fields), Answer, PATIENCE, absent)


def _print(answer: Answer, name: str) -> None:
    """Print the row of a shard or robot; all rows if ``name`` is empty."""
    for row in answer.shards:
        robots = [robot.name for robot in row.robots]
        if name in ("", row.name, *robots):
            if name not in ("", row.name) and len(robots) > 1:
                print(f"robot {name} shares shard {row.name} with others; this is the whole shard:")
            print(f"{row.name:6} {row.state:9} {', '.join(robots)} {_why(row)}".rstrip())


def _why(row: Row) -> str:
    if row.state == "ready" and not row.silent:
        return row.console or ""
    return str(row.reason)
