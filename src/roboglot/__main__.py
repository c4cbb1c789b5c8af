"""``python -m roboglot``, and the command ``roboglot``; Ctrl-C ends it silently, even while modules are loaded."""

import gc
import os
import signal
import sys

STDERR = 2


def hold_standard_files() -> None:
    """Open closed standard files, before a library or a socket gets one of their numbers and is read as input.

    uvloop aborts if one of its own descriptors has such a number.
    """
    while (null := os.open(os.devnull, os.O_RDWR)) <= STDERR:
        pass
    os.close(null)


def _look_elsewhere_last() -> None:
    """Search PYTHONPATH last, so that no module of another project shadows a library of ours."""
    others = {os.path.abspath(folder) for folder in os.environ.get("PYTHONPATH", "").split(os.pathsep) if folder}
    sys.path.sort(key=lambda folder: folder in others)


def _start_warm(words: list[str]) -> None:
    """Run a command that starts robots of its own in a fork of the warm parent, if there is one; else return."""
    if words[:1] in (["test"], ["lesson"]) or (words[:1] == ["program"] and "--own" in words):
        from roboglot.cli.warm import command

        status = command.run(command.COMMAND, words)
        if status is not None:
            command.end_like(status)


def run() -> None:
    """Load the command line and run it; SIGINT gets Python's own handler back once that is loaded.

    Garbage collection starts with the command: imports leave hardly any garbage, and would be scanned many times.
    """
    gc.disable()
    hold_standard_files()
    if os.getpid() == 1:  # in a container, where the kernel drops signals that have no handler yet
        signal.signal(signal.SIGTERM, lambda *_: os._exit(128 + signal.SIGTERM))
    _look_elsewhere_last()
    _start_warm(sys.argv[1:])
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from roboglot.cli import run_process

    signal.signal(signal.SIGINT, before)
    run_process()


if __name__ == "__main__":
    run()
