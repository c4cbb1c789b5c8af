"""The command line: one file per command, each loaded only when called."""

from __future__ import annotations

import atexit
import errno
import functools
import gc
import importlib
import io
import os
import sys
import threading
from collections.abc import Callable

TYPE_CHECKING = False  # without importing ``typing``, as a warm start takes only some milliseconds
if TYPE_CHECKING:
    from typing import NoReturn

    import typer

COMMANDS = {
    "up": "start the robots with all their doors",
    "fleet": "run many worlds, each in a separate process",
    "demo": "let four independent clients drive one robot, and draw their tracks on its map",
    "coverage": "show how much of each protocol is implemented",
    "capabilities": "show what each protocol can do on each kind of robot",
    "scan": "find robots on the network and show how to connect to them",
    "access": "give people, machines and apps rights to robots, or revoke them",
    "connect": "open the ports of a robot behind a gateway on this machine",
    "audit": "show who changed what on which robot, and what was refused",
    "lease": "show who moves each robot; take, give or release control",
    "stop": "stop a robot, or all of them",
    "reset": "put a simulated robot back at its start, charged and without faults",
    "record": "record everything that robots say, hear and do; show and repair recordings",
    "rerun": "run a lockstep recording again and compare every byte",
    "replay": "send the requests of a recording to a robot again and compare its answers",
    "export": "write a recording as a bag of ROS 2",
    "compare": "compare two recordings or robots",
    "fidelity": "compare the doors with published answers of real robots",
    "test": "play test scenarios (YAML) on simulated robots, with a JUnit report",
    "campaign": "play scenarios with many seeds on all cores; one table, one report",
    "mirror": "show the live state of any robot in the terminal",
    "map": "import and export maps, build them from recorded drives, merge floors",
    "program": "check, run, save and list block programs, and read their logs",
    "lesson": "check missions of the studio, or try a program in one",
    "mcp": "offer robots as tools to agents over the Model Context Protocol",
    "cloud": "run a back end for block programs: accounts, favourites, records",
    "cyberdog": "watch, drive and film a CyberDog 2, ours or a real one",
    "certs": "write the certificates that CyberDog clients need",
    "doctor": "show what is missing on this machine, and how to get it",
}
HELP, VERSION = ("--help", "-h"), ("--version", "-V")
FLUSH_FAILED = 120  # Python's own exit status for it
PREFIX = "ROBOGLOT_"
# The environment variables that are read, without their prefix.
VARIABLES = (
    *("ACCESS", "CLOUD_DATABASE", "CONSOLE", "CYBERDOG", "DATA", "DATABASE", "FAILURES", "FLEET", "INSECURE"),
    *("PROGRAMS", "RECORD", "REGISTRY", "RUN_AGAIN", "SEED", "SPEED", "TOKEN", "WARM", "WORLD"),
)
# Commands whose files have a separate folder.
FOLDERS = (
    dict.fromkeys(("compare", "export", "fidelity", "record", "replay", "rerun"), "recordings")
    | dict.fromkeys(("lease", "stop", "reset"), "control")
    | dict.fromkeys(("program", "lesson"), "programs")
)
FULL = errno.ENOSPC, errno.EDQUOT, errno.EFBIG  # of the disk to which the output goes, say
# The extra to install for a command whose modules are missing, if that brings them.
EXTRAS = (
    {"demo": "demo", "mcp": "mcp", "export": "recording,logs"}
    | dict.fromkeys(("record", "replay", "compare"), "recording")
    | dict.fromkeys(("up", "fleet", "coverage", "capabilities", "fidelity", "rerun", "cloud", "map", "program"), "up")
    | dict.fromkeys(("test", "lesson", "campaign"), "up")
)


def run_process() -> NoReturn:
    """Run ``main`` and end the process."""
    run_to_end(main)


def run_to_end(work: Callable[[], None]) -> NoReturn:
    """Run ``work`` and end the process as ``sys.exit`` would, but leave its memory to the kernel.

    The interpreter would free it object by object, which takes 0.7 s of processor time for a robot's server.
    """
    status = 0
    try:
        work()
    except SystemExit as end:
        status = _printed(end)
    # These are not public, but multiprocessing ends its children in the same way.
    vars(threading)["_shutdown"]()  # waits for threads
    vars(atexit)["_run_exitfuncs"]()
    try:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None and not stream.closed:
                stream.flush()
    except OSError:  # a full disk, or a closed pipe
        status = status or FLUSH_FAILED
    os._exit(status & 0xFF)


def _printed(end: SystemExit) -> int:
    """Print why the program ends, which may quote a peer or a file; return its exit status."""
    if isinstance(end.code, str):
        from roboglot.hosting.escaping import visible

        print(visible(end.code), file=sys.stderr)
    return end.code if isinstance(end.code, int) else int(end.code is not None)


def main() -> None:
    """``roboglot COMMAND …``; the commands' own options come from Typer."""
    _tolerate_plain_terminals()
    _warn_of_misspelt_variables()
    sys.argv[1:] = arguments = _without_help(sys.argv[1:]) or ["--help"]
    name = arguments[0]
    try:
        _run(name)
    except ModuleNotFoundError as missing:
        from roboglot.extras import explained

        words = explained(missing, f"roboglot {name}", EXTRAS.get(name, ""))
        if words is None:
            raise
        _run_with_extra(name, arguments)
        sys.exit(words)
    except KeyboardInterrupt:  # before the command installs its own handlers
        sys.exit(130)
    except BrokenPipeError:  # the reader of our output has closed it, as with `| head`
        sys.stderr.close()
        sys.exit(1)
    except OSError as error:
        if error.errno not in FULL:
            raise
        from roboglot.hosting.error_text import in_words

        sys.exit(f"roboglot {name}: {in_words(error)}")


def _without_help(words: list[str]) -> list[str]:
    """Return ``help COMMAND`` as ``COMMAND --help``."""
    return [*words[1:], "--help"] if words[:1] == ["help"] else words


def _run(name: str) -> None:
    if name in HELP:
        _print_usage()
    elif name in VERSION:
        from roboglot.cli.about import about

        print("\n".join(about()))
    elif name in COMMANDS:
        command = built(name)
        sys.argv[:2] = [f"roboglot {name}"]
        gc.freeze()  # everything loaded stays: the collector need not scan it
        gc.enable()
        command(prog_name=f"roboglot {name}")
    else:
        from roboglot.spelling import instead

        kind, known = ("option", (*HELP, *VERSION)) if name.startswith("-") else ("command", tuple(COMMANDS))
        sys.exit(f"roboglot: there is no {kind} {name!r}{instead(name, known)}")


def _run_with_extra(name: str, arguments: list[str]) -> None:
    """Run the command again with its extra if that installs nothing permanently; else return."""
    from roboglot.cli import throwaway

    if name in EXTRAS and (command := throwaway.runner()):
        throwaway.run_again(command, EXTRAS[name], arguments)


def _tolerate_plain_terminals() -> None:
    """Print ? for characters that a terminal without UTF-8 lacks."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _warn_of_misspelt_variables() -> None:
    """Print a warning for each variable that resembles a known one: Typer ignores it. Scripts may set others."""
    names = {name.removeprefix(PREFIX) for name in os.environ if name.startswith(PREFIX)}
    for name in sorted(names.difference(VARIABLES)):
        from roboglot.spelling import nearest

        if near := nearest(name, VARIABLES):
            print(f"roboglot: {PREFIX}{name} has no effect; did you mean {PREFIX}{near}?", file=sys.stderr)


def _print_usage() -> None:
    print("usage: roboglot COMMAND [OPTIONS]\n\nOne robot, every protocol.\n")
    for command, meaning in COMMANDS.items():
        print(f"  {command:12} {meaning}")
    print("\nroboglot COMMAND --help lists the options of a command; roboglot --version says what is installed.")


@functools.cache
def built(name: str) -> Callable[..., object]:
    """Return one of COMMANDS, to be called."""
    from typer.main import get_command

    return get_command(loaded(name))


def loaded(name: str) -> typer.Typer:
    """Import and return the application of one of COMMANDS."""
    import typer

    from roboglot.cli.suggestions import Command

    folder = f".{FOLDERS[name]}" if name in FOLDERS else ""
    module = importlib.import_module(f"roboglot.cli{folder}.{name}")
    app: typer.Typer | None = getattr(module, "app", None)  # for commands that have subcommands
    if app is None:
        app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        app.command(context_settings=getattr(module, "SETTINGS", None))(module.command)
    for command in app.registered_commands:
        command.cls = Command
    return app
