"""Plays trials on this machine, each in its own process, forked from a preloaded one."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing import forkserver, resource_tracker, util
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import ModuleType

import msgspec

from roboglot.hosting.leftovers import MARK, adopt_orphans, end_descendants, end_marked
from roboglot.shards.warm_up import ENVIRONMENT
from roboglot.testing.campaign.trials import Outcome, Result, Trial, play_trial
from roboglot.values import dataclass

END_SECONDS_MAX = 10.0
ATTEMPTS_MAX = 3  # for a trial whose process dies
PRELOADED = ["roboglot.testing.campaign.warmed"]
FOLDER = "ROBOGLOT_CAMPAIGN_FOLDER"  # environment variable with multiprocessing's own temporary folder
_OUTER = os.environ.get(MARK, "")  # of a scenario that runs this campaign
_MAIN = threading.Lock()  # held while our main program is hidden
Leave = Callable[[Trial], Path | None]
Ended = Callable[[Trial, Result], None]


@dataclass(slots=True)
class _Running:
    trial: Trial
    attempt: int
    process: BaseProcess
    receiver: Connection
    deadline: float
    scratch: str  # its folder for temporary files, which it cannot delete itself if it dies


def play_here(trials: Iterator[Trial], workers: int, seconds_max: float, leave: Leave, ended: Ended) -> None:
    """Play ``trials``, ``workers`` at a time; ``ended`` is called after each. Call it from the main thread.

    Raises KeyboardInterrupt at SIGINT and SIGTERM, once running trials have ended.
    """
    os.environ.update(ENVIRONMENT)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    os.environ[FOLDER] = util.get_temp_dir()
    _start_fork_server()
    running: list[_Running] = []

    def start(trial: Trial, attempt: int) -> None:
        running.append(_start(context, trial, attempt, leave(trial), seconds_max))

    with interruptions() as interrupted:
        _wait_for_fork_server(context, interrupted)
        try:
            while not interrupted.poll():
                while len(running) < workers and (trial := next(trials, None)) is not None:
                    start(trial, 1)
                if not running:
                    return
                for one in _done(running, interrupted):
                    running.remove(one)
                    result = _result(one, seconds_max)
                    if result.outcome is Outcome.CRASHED and one.attempt < ATTEMPTS_MAX:
                        start(one.trial, one.attempt + 1)
                    else:
                        ended(one.trial, msgspec.structs.replace(result, attempts=one.attempt))
        finally:
            for one in running:
                one.process.terminate()  # all at once
            for one in running:
                _end(one)
    raise KeyboardInterrupt


def _start(context: ForkServerContext, trial: Trial, attempt: int, folder: Path | None, seconds_max: float) -> _Running:
    """Start a trial in its own process."""
    receiver, sender = context.Pipe(duplex=False)
    scratch = tempfile.mkdtemp(prefix="roboglot-trial-")
    process = context.Process(target=_play, args=(trial, folder, scratch, sender), daemon=False)
    _begin(process)
    sender.close()
    return _Running(trial, attempt, process, receiver, _now() + seconds_max, scratch)


def _begin(process: BaseProcess) -> None:
    """Start a process that does not import our main program: Ray's takes seconds."""
    with _MAIN:
        main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
        try:
            process.start()
        finally:
            sys.modules["__main__"] = main


def _done(running: list[_Running], interrupted: Connection) -> list[_Running]:
    """Wait until a trial ends, is late, or is interrupted; return those that have ended or are late."""
    nearest = min(one.deadline for one in running)
    wait([interrupted, *(one.receiver for one in running)], max(0.0, nearest - _now()))
    return [one for one in running if one.receiver.poll() or one.deadline <= _now()]


def _start_fork_server() -> None:
    """Start the process from which trials are forked; it blocks Ctrl-C from the start, which is for the campaign."""
    resource_tracker.ensure_running()  # it would unblock SIGINT
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # a new program inherits it; none is lost here
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _wait_for_fork_server(context: ForkServerContext, interrupted: Connection) -> None:
    """Wait until that process has loaded everything; end it when interrupted: starting a trial would wait for it."""
    receiver, sender = context.Pipe(duplex=False)

    def fork() -> None:
        with contextlib.suppress(EOFError, OSError):  # it was ended
            _begin(context.Process(target=_now))
        sender.close()

    threading.Thread(target=fork, daemon=True).start()
    wait([interrupted, receiver])
    if not receiver.poll():
        os.kill(vars(forkserver._forkserver)["_forkserver_pid"], signal.SIGKILL)


@contextlib.contextmanager
def interruptions() -> Iterator[Connection]:
    """Deliver SIGINT and SIGTERM through a pipe: raised anywhere, they could lose a process that was just started."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    numbers = signal.SIGINT, signal.SIGTERM
    before = [(number, signal.signal(number, lambda *_: sender.send_bytes(b"!"))) for number in numbers]
    try:
        yield receiver
    finally:
        for number, handler in before:
            signal.signal(number, handler)
        receiver.close()
        sender.close()


def _now() -> float:
    return time.monotonic()  # noqa: TID251 - a process of another machine's time


def _result(one: _Running, seconds_max: float) -> Result:
    """Return the result that the trial's process reported; end the process if it is late."""
    try:
        if not one.receiver.poll():
            return Result(Outcome.LATE, f"it was ended after {seconds_max:.0f} s", seconds_max)
        return msgspec.json.decode(one.receiver.recv_bytes(), type=Result)
    except (EOFError, OSError):
        one.process.join(5.0)
        seconds = seconds_max - (one.deadline - _now())
        return Result(Outcome.CRASHED, f"its process ended with {one.process.exitcode}", seconds)
    finally:
        one.receiver.close()
        _end(one)


def _end(one: _Running) -> None:
    """Terminate the process, so that it can end its children; then kill its group, and delete its temporary files."""
    process = one.process
    process.terminate()
    process.join(END_SECONDS_MAX)
    if process.pid is not None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.join()
    end_marked(_mark(one.scratch))  # what a trial that was killed has left
    shutil.rmtree(one.scratch, ignore_errors=True)


def _play(trial: Trial, leave: Path | None, scratch: str, sender: Connection) -> None:
    """Play in the forked process, in its own group, so that Ctrl-C reaches the campaign alone; it ends with that."""
    os.setpgid(0, 0)
    adopt_orphans()
    tempfile.tempdir = os.environ["TMPDIR"] = scratch
    os.environ[MARK] = _mark(scratch)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # for the commands of its scenario
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    threading.Thread(target=_end_with_campaign, daemon=True).start()
    try:
        result = play_trial(trial, leave)
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it has been obeyed
        end_descendants()
        shutil.rmtree(scratch, ignore_errors=True)  # the campaign may have been killed
    sender.send_bytes(msgspec.json.encode(result))
    sender.close()


def _mark(scratch: str) -> str:
    """Return the mark of a trial's processes."""
    return ":".join(filter(None, (_OUTER, Path(scratch).name)))


def _end_with_campaign() -> None:
    """Wait for the campaign to end, even by ``kill -9``, then have the main thread end the trial's children."""
    campaign = multiprocessing.parent_process()
    assert campaign is not None
    campaign.join()
    shutil.rmtree(os.environ[FOLDER], ignore_errors=True)  # if the fork server was killed, too
    os.kill(os.getpid(), signal.SIGTERM)
