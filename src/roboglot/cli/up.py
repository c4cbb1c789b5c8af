"""``roboglot up``: start the robots with all their doors and keep them up until Ctrl-C."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import errno
import gc
import inspect
import math
import os
import select
import signal
import sqlite3
import sys
import threading
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboglot.cli.screen import announce, warn_if_open
from roboglot.config import Config, RobotConfig, load_config, parse_robot, refuse_unguarded
from roboglot.hosting import open_files
from roboglot.hosting.closing import started
from roboglot.hosting.error_text import in_words
from roboglot.hosting.folder_lock import FolderInUse
from roboglot.hosting.logs import set_up_logging
from roboglot.hosting.process import end_in_any_case, prepare
from roboglot.model.clock import LockstepClock
from roboglot.protocols import DOORS, sections
from roboglot.protocols.door import Option

if TYPE_CHECKING:
    from roboglot.runtime import Runtime

STANDARD_INPUT = 0
DATABASE_MIN = 1 << 16  # bytes of free disk without which it cannot be opened
LINE_MAX = 64  # bytes per line of standard input in lockstep
FILE_MAX = 1 << 20  # bytes of a file in its place
STEP_MAX = 86_400.0  # s that one line may advance

World = Annotated[
    str | None,
    typer.Option(envvar="ROBOGLOT_WORLD", help="A shipped world, a .toml of yours, or a ROS map (.yaml)."),
]
Robots = Annotated[
    list[str] | None,
    typer.Option(
        help="NAME=BODY, NAME=BODY:X,Y,YAW,FLOOR or NAME=URL of a real robot, optionally with @ADDRESS; repeat for"
        " more. Robot a always exists."
    ),
]
Address = Annotated[str | None, typer.Option(help="Address of robot a; the others follow it.")]
Speed = Annotated[float | None, typer.Option(envvar="ROBOGLOT_SPEED", help="Robot seconds per real second.")]
Lockstep = Annotated[
    bool | None,
    typer.Option("--lockstep", help="Advance time only by the seconds in each line of standard input."),
]
Seed = Annotated[int | None, typer.Option(envvar="ROBOGLOT_SEED", help="Seed of all random numbers in the world.")]
Data = Annotated[
    Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="Folder for maps, places, programs and certificates.")
]
Registry = Annotated[
    str | None,
    typer.Option(
        metavar="URL|FILE",
        envvar="ROBOGLOT_REGISTRY",
        help="Registry of which program runs which robot; the database by default.",
    ),
]
Database = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        envvar="ROBOGLOT_DATABASE",
        help="Store the robots' data in PostgreSQL (postgresql://...) instead of in the data folder.",
    ),
]
Access = Annotated[
    bool,
    typer.Option(
        "--access", envvar="ROBOGLOT_ACCESS", help="Require clients to identify themselves: see `roboglot access`."
    ),
]
Insecure = Annotated[
    bool,
    typer.Option(
        "--insecure",
        envvar="ROBOGLOT_INSECURE",
        help="Let anyone drive robots, also from outside loopback; overrides \\[access].",
    ),
]
WithConsole = Annotated[bool, typer.Option(help="Serve pages to see and drive the robots in a browser.")]
OpenConsole = Annotated[bool, typer.Option("--open", help="Open the console in this machine's browser.")]
Record = Annotated[
    str,
    typer.Option(metavar="FILE|DIR", envvar="ROBOGLOT_RECORD", help="Record everything: see `roboglot record`."),
]
RecordRing = Annotated[
    bool, typer.Option("--record-ring", help="Keep the last five minutes, and write them at a fault.")
]
ConfigFile = Annotated[Path | None, typer.Option(help="TOML file with settings: see docs/settings.md.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Log every request.")]


def command(
    world: World = None,
    robot: Robots = None,
    address: Address = None,
    speed: Speed = None,
    lockstep: Lockstep = None,
    seed: Seed = None,
    data: Data = None,
    registry: Registry = None,
    database: Database = None,
    access: Access = False,
    insecure: Insecure = False,
    console: WithConsole = True,
    open_console: OpenConsole = False,
    record: Record = "",
    record_ring: RecordRing = False,
    config: ConfigFile = None,
    verbose: Verbose = False,
    **doors: object,
) -> None:
    """Start the robots with all their doors; Ctrl-C stops them."""
    set_up_logging(verbose)
    try:
        settings = load_config(
            config,
            {
                "world": world,
                "robots": _robots(robot) if robot else None,
                "address": address,
                "speed": speed,
                "lockstep": lockstep or None,
                "seed": seed,
                "data": str(data) if data else None,
                "database": database,
                "registry": registry,
                **_sections(doors),
                "access": access_section(on=access, insecure=insecure),
                "console": None if console else {"enabled": False},
                "record": ({"to": record} if record else {}) | ({"ring": True} if record_ring else {}) or None,
                "insecure": insecure or None,
            },
            sections(),
        )
        refuse_unguarded(settings)
    except ValueError as error:
        sys.exit(f"roboglot up: {error}")
    open_files.raise_limit()
    if shortage := open_files.shortage(len(settings.robots)):
        sys.exit(f"roboglot up: {shortage}")
    prepare()
    import uvloop

    sys.exit(uvloop.run(_serve(settings, open_console=open_console)))


def access_section(*, on: bool, insecure: bool) -> dict[str, object] | None:
    """Return the options' section [access]; --insecure overrides the file's. Raises ValueError for both options."""
    if on and insecure:
        raise ValueError("--access requires names and --insecure lets everyone in: give one of them")
    return {"on": on} if on or insecure else None


def _parameter(option: Option) -> str:
    return option.flag.removeprefix("--").replace("-", "_")


def _with_door_options() -> inspect.Signature:
    """Return the command's signature with the doors' own options, which Typer reads from it."""
    signature = inspect.signature(command, eval_str=True)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    added = [
        inspect.Parameter(
            _parameter(option),
            inspect.Parameter.KEYWORD_ONLY,
            default="" if option.value is None else False,
            annotation=Annotated[str if option.value is None else bool, typer.Option(option.flag, help=option.help)],
        )
        for door in DOORS
        for option in door.options
    ]
    return signature.replace(parameters=[*own, *added])


def _sections(given: Mapping[str, object]) -> dict[str, object]:
    """Return the doors' sections of the configuration, from the given options."""
    found: dict[str, object] = {}
    for door in DOORS:
        values = {
            option.setting: given[_parameter(option)] if option.value is None else option.value
            for option in door.options
            if given.get(_parameter(option))
        }
        found |= {door.name: values} if values else {}
    return found


def _robots(texts: list[str]) -> list[dict[str, object]]:
    """Return robot a first, with the options of the command line, then the others. Raises ValueError."""
    robots = {"a": RobotConfig()}
    for number, robot in enumerate(map(parse_robot, texts)):
        if any(text.startswith(f"{robot.name}=") for text in texts[:number]):
            raise ValueError(f"robot {robot.name} is given twice: by {texts[number]!r}, and before")
        robots[robot.name] = robot
    return [dataclasses.asdict(robot) for robot in robots.values()]


async def _serve(config: Config, *, open_console: bool) -> int:
    """Run until a signal; return the exit status."""
    gc.disable()  # until the robots are there: a tenth of their start
    from roboglot.runtime import Runtime

    stop = asyncio.Event()
    open_files.OpenFiles().watch(asyncio.get_running_loop())
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    try:
        runtime = Runtime(config)
    except (FolderInUse, ValueError, OSError) as error:
        return _failed(open_files.in_words() if open_files.ran_out(error) else in_words(error))
    except sqlite3.Error as error:
        return _failed(f"the database in {config.data} can't be used: {_why(error, config.data)}")
    from roboglot.model.errors import RobotError

    try:
        await _run(runtime, stop, open_console=open_console)
    except OSError as error:
        taken = "; is another robot up? --address chooses another" if error.errno == errno.EADDRINUSE else ""
        return _failed(open_files.in_words() if open_files.ran_out(error) else f"{error.strerror or error}{taken}")
    except RobotError as error:  # nothing can be recorded
        return _failed(str(error))
    finally:
        gc.enable()
        await runtime.close()
    return 0


async def _run(runtime: Runtime, stop: asyncio.Event, *, open_console: bool) -> None:
    """Start the robots, announce that, and wait until ``stop`` is set."""
    warn_if_open(runtime.config)
    if not await started(runtime.start(), stop):
        return
    gc.enable()
    page = runtime.console.address if runtime.console is not None and runtime.console.port else ""
    announce(runtime.config, {name: doors.endpoints for name, doors in runtime.doors.items()}, page)
    print("ready", flush=True)
    if page and open_console:
        import webbrowser

        threading.Thread(target=webbrowser.open, args=(page,), daemon=True).start()  # it may wait for a browser
    stepping = asyncio.ensure_future(_step(runtime.clock)) if isinstance(runtime.clock, LockstepClock) else None
    await stop.wait()
    end_in_any_case()
    if stepping:
        stepping.cancel()


def _failed(why: str) -> int:
    """Print why the program ends; return its exit status."""
    print(f"roboglot up: {why}", file=sys.stderr)
    return 1


def _why(error: sqlite3.Error, folder: Path) -> str:
    """Return why the database cannot be used; SQLite calls a full disk an I/O error."""
    disk = os.statvfs(folder)
    return "the disk is full" if disk.f_bavail * disk.f_frsize < DATABASE_MIN else str(error)


async def _step(clock: LockstepClock) -> None:
    """Advance by the seconds on each line of standard input; answer each with the time reached."""
    async for line in lines_of(STANDARD_INPUT):
        try:
            seconds = float(line)
        except ValueError:
            seconds = math.nan
        if 0 <= seconds <= STEP_MAX:
            await clock.advance(seconds)
        else:
            print(f"expected seconds from 0 to {STEP_MAX:g}, not {line!r}", file=sys.stderr)
        print(f"time {clock.time():.3f}\n", end="", flush=True)  # in one piece, also if output has no buffer


async def lines_of(descriptor: int) -> AsyncIterator[str]:
    """Yield the lines of a file, a pipe or a terminal until it ends; it stays open: no socket gets its number."""
    reader = asyncio.StreamReader(limit=LINE_MAX)
    with contextlib.suppress(OSError), os.fdopen(descriptor, "rb", closefd=False) as file:
        if _can_wait(descriptor):
            await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), file)
        else:
            data = file.read(FILE_MAX + 1)
            if len(data) > FILE_MAX:
                print(f"expected at most {FILE_MAX} bytes in a file of seconds; use a pipe for more", file=sys.stderr)
                return
            reader.feed_data(data)
            reader.feed_eof()
        while True:
            try:
                line = await reader.readline()
            except ValueError:  # longer than LINE_MAX; the reader has discarded it
                line = b"(a line that is too long)\n"
            if not line:
                return
            yield line.decode("utf-8", "replace").strip()


def _can_wait(descriptor: int) -> bool:
    """Return whether an event loop can wait for data: not of files and of /dev/null. Raises OSError if closed."""
    with select.epoll() as poll:
        try:
            poll.register(descriptor)
        except PermissionError:
            return False
    return True


SIGNATURE = _with_door_options()
vars(command)["__signature__"] = SIGNATURE
command.__annotations__ = {name: parameter.annotation for name, parameter in SIGNATURE.parameters.items()}
