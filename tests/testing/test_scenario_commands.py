"""Commands of scenarios: their status and output, and the end of all that they have started."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from roboglot.hosting.leftovers import MARK
from roboglot.hosting.process import has_ended
from roboglot.testing.scenarios.commands import OUTPUT_MAX, Commands, NotEnded

PATIENCE = 60.0  # s
STAYS = "env -i setsid sh -c 'echo $$ >left; exec sleep 3600' & until test -s left; do sleep 0.01; done"


@pytest.fixture
def commands(tmp_path: Path) -> Iterator[Commands]:
    with contextlib.closing(Commands(tmp_path, lambda: {**os.environ, "HERE": "a place"})) as made:
        yield made


def wait_for_end(left: Path) -> None:
    end = time.monotonic() + PATIENCE
    while not has_ended(int(left.read_text())):
        assert time.monotonic() < end
        time.sleep(0.01)


def test_commands_report_status_and_output(commands: Commands, tmp_path: Path) -> None:
    assert commands.run("echo $HERE; pwd >&2", PATIENCE) == (0, f"a place\n{tmp_path}\n")
    assert commands.run("exit 3", PATIENCE) == (3, "")
    assert commands.run("kill -9 $$", PATIENCE) == (-signal.SIGKILL, "")
    assert commands.run(f"printf $'a\\xff' | cat; : {'x' * (1 << 18)}", PATIENCE)[0] == 126
    assert commands.run(f"head -c {OUTPUT_MAX} /dev/zero | tr '\\0' a; echo b", PATIENCE)[1].endswith("ab\n")
    assert commands.run(f"test ${MARK} && cat", PATIENCE) == (0, "")


def test_output_that_stays_open_holds_nothing_up(commands: Commands, tmp_path: Path) -> None:
    """A server in the background has the output of the command that started it."""
    status, output = commands.run(f"echo up; {STAYS}; echo end", PATIENCE)
    assert (status, output) == (0, "up\nend\n")
    assert not has_ended(int((tmp_path / "left").read_text()))
    commands.close()
    wait_for_end(tmp_path / "left")


def test_late_commands_end_with_all_they_started(commands: Commands, tmp_path: Path) -> None:
    with pytest.raises(NotEnded, match=r"^begun\n$"):
        commands.run(f"echo begun; {STAYS}; sleep 3600", 2.0)
    wait_for_end(tmp_path / "left")


def test_a_killed_test_leaves_no_process(tmp_path: Path) -> None:
    program = (
        "import os, signal; from pathlib import Path; from roboglot.testing.scenarios.commands import Commands\n"
        f"Commands(Path.cwd(), lambda: os.environ).run({STAYS!r}, {PATIENCE})\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, timeout=PATIENCE, check=False)
    assert done.returncode == -signal.SIGKILL
    wait_for_end(tmp_path / "left")


def test_killed_keeper_is_named(commands: Commands) -> None:
    with pytest.raises(OSError, match=r"the process that runs commands was ended\nlast words\n$"):
        commands.run("echo last words; kill -9 $PPID; sleep 3600", PATIENCE)
