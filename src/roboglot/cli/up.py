"""``roboglot up``: start the robots with all their doors and keep them up until Ctrl-C."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import errno
import math
import os
import signal
import sqlite3
import sys
import threading
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated

import typer

from roboglot.cli import open_files
from roboglot.cli.screen import announce, set_up_logging, warn_if_open
from roboglot.config import Config, RobotConfig, load_config, parse_robot, refuse_unguarded
from roboglot.model.clock import LockstepClock

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8  # of malloc.h
EXPLANATION_PORT = 40928  # of `--explain`; no RoboMaster client knows it
LINE_MAX = 64  # bytes of a line that lockstep reads from standard input
STEP_MAX = 86_400.0  # s that one line may let pass
SWITCH_SECONDS = 0.001  # that other threads (the database's, pictures') may keep the one that answers clients waiting
LAST_SECONDS = 10.0  # after a signal; closing takes one or two


def command(
    world: Annotated[
        str | None,
        typer.Option(envvar="ROBOGLOT_WORLD", help="A shipped world, a .toml of yours, or a ROS map (.yaml)."),
    ] = None,
    robot: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=BODY or NAME=URL of a real one, @ADDRESS if wanted; repeat for more. Robot a is always there."
        ),
    ] = None,
    address: Annotated[str | None, typer.Option(help="Address of robot a; the others follow it.")] = None,
    speed: Annotated[float | None, typer.Option(envvar="ROBOGLOT_SPEED", help="Robot seconds per real second.")] = None,
    lockstep: Annotated[
        bool | None,
        typer.Option("--lockstep", help="Time passes only when a line with seconds comes on standard input."),
    ] = None,
    seed: Annotated[int | None, typer.Option(envvar="ROBOGLOT_SEED", help="Of all chance in the world.")] = None,
    data: Annotated[
        Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="Folder for programs, places, certificates.")
    ] = None,
    app: Annotated[str, typer.Option(help="HOST:PORT of the CyberDog app to call; else whoever called last.")] = "",
    plaintext: Annotated[bool, typer.Option("--plaintext", help="CyberDog without TLS, on loopback only.")] = False,
    robomaster_profile: Annotated[
        str, typer.Option(help="How the RoboMaster door words things: spec, or a robot's build: fw60, fw70.")
    ] = "",
    robomaster_lenient: Annotated[
        bool, typer.Option("--robomaster-lenient", help="Also run RoboMaster commands sent without `;`.")
    ] = False,
    explain: Annotated[
        bool,
        typer.Option("--explain", help=f"Say why RoboMaster commands are refused, on TCP port {EXPLANATION_PORT}."),
    ] = False,
    uart: Annotated[str, typer.Option(help="Path of a RoboMaster serial line; -NAME of the robot is appended.")] = "",
    programs_without_filter: Annotated[
        bool,
        typer.Option(
            "--programs-without-filter",
            help="Run block programs also where the kernel can't lock them in: trusted ones.",
        ),
    ] = False,
    access: Annotated[
        bool,
        typer.Option("--access", envvar="ROBOGLOT_ACCESS", help="Ask who comes: see `roboglot access`."),
    ] = False,
    insecure: Annotated[
        bool,
        typer.Option("--insecure", envvar="ROBOGLOT_INSECURE", help="Let anyone drive robots outside loopback."),
    ] = False,
    config: Annotated[Path | None, typer.Option(help="A TOML file with any of these and more.")] = None,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log every request.")] = False,
) -> None:
    """Start the robots with all their doors; Ctrl-C stops them."""
    set_up_logging(verbose)
    cyberdog = {key: value for key, value in (("app", app), ("plaintext", plaintext)) if value}
    visual = {"without_filter": True} if programs_without_filter else None
    texts = (
        ("profile", robomaster_profile),
        ("lenient", robomaster_lenient),
        ("uart", uart),
        ("explanation_port", EXPLANATION_PORT if explain else None),
    )
    robomaster = {key: value for key, value in texts if value}
    try:
        settings = load_config(
            config,
            {
                "world": world,
                "robots": _robots(robot or [], address) if robot or address else None,
                "speed": speed,
                "lockstep": lockstep or None,
                "seed": seed,
                "data": str(data) if data else None,
                "cyberdog": cyberdog or None,
                "robomaster": robomaster or None,
                "visual": visual,
                "access": {"on": True} if access else None,
                "insecure": insecure or None,
            },
        )
        refuse_unguarded(settings)
    except ValueError as error:
        sys.exit(f"roboglot up: {error}")
    open_files.raise_limit()
    if shortage := open_files.shortage(len(settings.robots)):
        sys.exit(f"roboglot up: {shortage}")
    _give_memory_back()
    sys.setswitchinterval(SWITCH_SECONDS)
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")  # what matters of it is told by the door itself
    if settings.lockstep:
        sys.exit(asyncio.run(_serve(settings)))
    import uvloop

    sys.exit(uvloop.run(_serve(settings)))


def _robots(texts: list[str], address: str | None) -> list[dict[str, str]]:
    """Robot a first, whatever the command line says of it, then the others."""
    robots = {"a": RobotConfig()} | {r.name: r for r in map(parse_robot, texts)}
    rows = [{"name": r.name, "body": r.body, "address": r.address} for r in robots.values()]
    rows[0]["address"] = address or rows[0]["address"]
    return rows


def _give_memory_back() -> None:
    """Tell glibc to keep one heap and to return large blocks at once: maps come and go, and 30 MB fewer stay held."""
    with contextlib.suppress(OSError, AttributeError):  # another C library has its own ways
        mallopt = ctypes.CDLL(None).mallopt
        for parameter, value in ((M_ARENA_MAX, 1), (M_MMAP_THRESHOLD, 1 << 17), (M_TRIM_THRESHOLD, 1 << 17)):
            mallopt(parameter, value)


async def _serve(config: Config) -> int:
    """Run until a signal; the exit status."""
    from roboglot.runtime import AlreadyRunning, Runtime

    stop = asyncio.Event()
    open_files.OpenFiles().watch(asyncio.get_running_loop())
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    try:
        runtime = Runtime(config)
    except (AlreadyRunning, ValueError, OSError) as error:
        print(f"roboglot up: {open_files.in_words() if open_files.ran_out(error) else error}", file=sys.stderr)
        return 1
    except sqlite3.Error as error:
        print(f"roboglot up: the database in {config.data} can't be used: {error}", file=sys.stderr)
        return 1
    try:
        warn_if_open(config)
        await runtime.start()
        announce(config, {name: doors.endpoints for name, doors in runtime.doors.items()})
        print("ready", flush=True)
        stepping = asyncio.ensure_future(_step(runtime.clock)) if isinstance(runtime.clock, LockstepClock) else None
        await stop.wait()
        _end_in_any_case()
        if stepping:
            stepping.cancel()
    except OSError as error:
        taken = "; is another robot up? --address chooses another" if error.errno == errno.EADDRINUSE else ""
        why = open_files.in_words() if open_files.ran_out(error) else f"{error.strerror or error}{taken}"
        print(f"roboglot up: {why}", file=sys.stderr)
        return 1
    finally:
        await runtime.close()
    return 0


def _end_in_any_case() -> None:
    """Whatever may still wait for something in a while: whoever told us to end must not have to kill us."""
    timer = threading.Timer(LAST_SECONDS, os._exit, (1,))
    timer.daemon = True
    timer.start()


async def _step(clock: LockstepClock) -> None:
    """Each line on standard input is seconds to pass; each is answered by the time reached."""
    async for line in _lines():
        try:
            seconds = float(line)
        except ValueError:
            seconds = math.nan
        if 0 <= seconds <= STEP_MAX:
            await clock.advance(seconds)
        else:
            print(f"seconds between 0 and {STEP_MAX:g} are wanted, not {line!r}", file=sys.stderr)
        print(f"time {clock.time():.3f}", flush=True)


async def _lines() -> AsyncIterator[str]:
    """Lines of standard input, until it ends."""
    reader = asyncio.StreamReader(limit=LINE_MAX)
    with contextlib.suppress(PermissionError, OSError):  # standard input may be a file or closed
        await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), os.fdopen(0))
        while True:
            try:
                line = await reader.readline()
            except ValueError:  # longer than LINE_MAX; the reader has dropped it
                line = b"(a line that is too long)\n"
            if not line:
                return
            yield line.decode("utf-8", "replace").strip()
